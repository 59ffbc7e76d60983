from workbench.report import Phase
from workbench.report.phases import phases, with_prompts

RAMP = [(0.1 * k, 3.0 * k) for k in range(5)]


def test_a_drive_rests_ramps_holds_and_ends() -> None:
    bar = phases("hop", -2.0, [*RAMP, (0.5, 17.0), (10.0, 0.0)], 10.0)
    assert bar == (Phase(-2.0, "rest"), Phase(0.0, "ramp"), Phase(0.5, "hold"), Phase(10.0, "off"))


def test_a_drive_without_a_ramp_holds_at_once() -> None:
    names = [state.name for state in phases("clamped", -1.0, [(0.0, 9.0), (5.0, 0.0)], 5.0)]
    assert names == ["rest", "hold", "off"]


def test_each_level_of_a_staircase_is_named() -> None:
    steps = [(0.0, 3.0), (0.1, 6.0), (5.0, 6.5), (5.1, 7.0), (10.0, 0.0)]
    bar = phases("clamped", -1.0, steps, 10.0)
    assert [state.name for state in bar] == [
        "rest", "ramp", "hold 6.00 rad/s", "ramp", "hold 7.00 rad/s", "off",
    ]  # fmt: skip


def test_a_drive_that_never_began_only_rests() -> None:
    assert phases("hop", -2.0, [], 0.0) == (Phase(-2.0, "rest"),)


def test_a_release_has_no_ramp() -> None:
    assert phases("decay", -2.0, [], 4.0) == (Phase(-2.0, "rest"), Phase(0.0, "ring-down"))
    assert phases("drop", -2.0, [], 4.0)[-1].name == "drop"


def test_a_prompt_stands_between_what_was_on_before_and_after() -> None:
    bar = (Phase(-4.0, "rest"), Phase(0.0, "ring-down"))
    asked = with_prompts(bar, [(-2.0, -0.5)])
    assert asked == (
        Phase(-4.0, "rest"),
        Phase(-2.0, "prompt"),
        Phase(-0.5, "rest"),
        Phase(0.0, "ring-down"),
    )


def test_a_prompt_that_outlasts_a_state_hides_its_beginning() -> None:
    bar = (Phase(-4.0, "rest"), Phase(0.0, "hold"), Phase(10.0, "off"))
    names = [(state.time_s, state.name) for state in with_prompts(bar, [(9.0, 12.0)])]
    assert names == [(-4.0, "rest"), (0.0, "hold"), (9.0, "prompt"), (12.0, "off")]


def test_a_prompt_that_took_no_time_is_left_out() -> None:
    bar = (Phase(-4.0, "rest"), Phase(0.0, "hold"))
    assert with_prompts(bar, [(-1.0, -1.0), (-9.0, -8.0)]) == bar
