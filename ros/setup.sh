# Source this file to let ROS 1 find the packages of this folder, on this machine: `. ros/setup.sh`
# Works in bash, zsh and, from the folder above this one, in any POSIX shell. Debian's ROS has no setup.bash of its own.

# Each shell names a sourced file differently; the eval hides zsh's syntax from the others.
if [ -n "${BASH_VERSION:-}" ]; then
    _ros=$(dirname "${BASH_SOURCE[0]}")
elif [ -n "${ZSH_VERSION:-}" ]; then
    _ros=$(eval 'dirname "${(%):-%x}"')
else
    _ros=ros
fi

if [ -e "$_ros/my_cam/package.xml" ]; then
    _ros=$(cd "$_ros" && pwd)
    # Add the packages only once.
    case ":${ROS_PACKAGE_PATH:-}:" in
        *":$_ros/my_cam:"*) ;;
        *)
            # Ours come before the course's packages of the same names, and ROS's own xacro before ours.
            _ours="$_ros/my_cam:$_ros/ros_hand_gesture_recognition:$_ros/ros_mobile_robot"
            export ROS_PACKAGE_PATH="$_ours:${ROS_PACKAGE_PATH:+$ROS_PACKAGE_PATH:}/usr/share:$_ros/xacro"
            unset _ours
            ;;
    esac
    export ROS_MASTER_URI="${ROS_MASTER_URI:-http://localhost:11311}"
    # Keep an address that is set: other machines may need it.
    [ -n "${ROS_IP:-}" ] || export ROS_HOSTNAME="${ROS_HOSTNAME:-localhost}"
else
    echo "handsteer: cannot find ros/setup.sh: source it from the folder above, with . ros/setup.sh" >&2
fi
unset _ros
