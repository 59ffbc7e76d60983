import pytest

from workbench import errors


@pytest.mark.parametrize(
    ("kind", "code"),
    [
        (errors.WorkbenchError, 1),
        (errors.InputError, 2),
        (errors.FileFaults, 2),
        (errors.TakeError, 2),
        (errors.PrintRefused, 1),
        (errors.HardwareError, 3),
        (errors.SafetyStop, 4),
        (errors.Interrupted, 130),
    ],
)
def test_exit_codes_are_those_of_the_command_line(kind: type, code: int) -> None:
    assert kind.exit_code == code


def test_faults_come_in_the_order_of_the_lines_with_a_caret() -> None:
    later = errors.FileFault("a.yaml", 9, 1, "second")
    first = errors.FileFault("a.yaml", 2, 3, "first", "  key: 1")
    text = str(errors.FileFaults([later, first]))
    assert text == "a.yaml:2:3: first\n      key: 1\n      ^\na.yaml:9:1: second"
