# Source it: lets ROS 1 find the packages of this folder, and this machine find itself. `. ros/setup.sh`
# Works in bash, zsh and, from the folder above this one, in any POSIX shell. Debian's ROS has no setup.bash of its own.

# Each shell names a sourced file in its own way; others would stumble over zsh's, hence the eval.
if [ -n "${BASH_VERSION:-}" ]; then
    _ros=$(dirname "${BASH_SOURCE[0]}")
elif [ -n "${ZSH_VERSION:-}" ]; then
    _ros=$(eval 'dirname "${(%):-%x}"')
else
    _ros=ros
fi

if [ -e "$_ros/my_cam/package.xml" ]; then
    _ros=$(cd "$_ros" && pwd)
    # Sourced twice, it adds nothing twice.
    case ":${ROS_PACKAGE_PATH:-}:" in
        *":$_ros/my_cam:"*) ;;
        *)
            # Ours first, so that they are found before the course's packages of the same names; xacro last, so that
            # ROS's own is found before it.
            _ours="$_ros/my_cam:$_ros/ros_hand_gesture_recognition:$_ros/ros_mobile_robot"
            export ROS_PACKAGE_PATH="$_ours:${ROS_PACKAGE_PATH:+$ROS_PACKAGE_PATH:}/usr/share:$_ros/xacro"
            unset _ours
            ;;
    esac
    export ROS_MASTER_URI="${ROS_MASTER_URI:-http://localhost:11311}"
    # A machine that has been told its address keeps it: others may have to reach it.
    [ -n "${ROS_IP:-}" ] || export ROS_HOSTNAME="${ROS_HOSTNAME:-localhost}"
else
    echo "handsteer: cannot tell where ros/setup.sh is: source it from the folder above, as . ros/setup.sh" >&2
fi
unset _ros
