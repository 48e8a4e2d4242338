"""``handsteer completion``: words for the shell to complete."""

from typing import Literal


def completion(shell: Literal["bash", "zsh", "fish"], /) -> int:
    """Print a script with which a shell completes verbs, options, parameters and their values.

    For example:
      handsteer completion bash > handsteer.bash  then: . ./handsteer.bash
      handsteer completion zsh > ~/.zfunc/_handsteer
      handsteer completion fish > ~/.config/fish/completions/handsteer.fish

    Parameters
    ----------
    shell
        The shell; the script works without starting Python.
    """
    from handsteer.cli.app import app, with_parameters

    with_parameters(app)
    print(app.generate_completion(shell=shell))
    return 0
