from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handstudio.errors import SetupError
from handstudio.simulation.imperfections.strengths import (
    GROUPS,
    HARSH,
    IDEAL,
    NAMES,
    PRESETS,
    TYPICAL,
    Imperfections,
    parse,
    tell,
    told,
)
from handstudio.simulation.imperfections.table import TABLE

strengths = st.one_of(st.sampled_from([0.0, 1.0, 2.5]), st.floats(0.0, 10.0))


@given(
    st.sampled_from(list(PRESETS.values())),
    st.dictionaries(st.sampled_from([*NAMES, *GROUPS]), strengths, max_size=8),
)
def test_what_is_told_is_understood_as_the_same(base, changes):
    values = told(base)
    for name, strength in changes.items():
        values |= dict.fromkeys(GROUPS.get(name, (name,)), strength)
    imperfections = Imperfections(**values)
    assert parse(tell(imperfections)) == imperfections


@pytest.mark.parametrize("preset", PRESETS)
def test_a_preset_is_told_by_its_name(preset):
    assert tell(PRESETS[preset]) == preset
    assert parse(preset) == PRESETS[preset]


def test_a_description_is_followed_from_left_to_right():
    asked = parse(" typical , -soft_tissue, scale=2,wobble ")
    expected = told(TYPICAL) | {"slide": 0.0, "rock": 0.0, "wobble": 1.0, "scale": 2.0}
    assert told(asked) == expected
    assert tell(asked) == "typical,scale=2,-slide,-rock"
    assert tell(parse("typical,-soft_tissue")) == "typical,-soft_tissue"


def test_without_a_preset_nothing_is_wrong_but_what_is_named():
    assert parse("bias=0.5,magnetic") == Imperfections(
        bias=0.5, **dict.fromkeys(GROUPS["magnetic"], 1.0)
    )


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("typical,scael=2", "There is no imperfection 'scael'"),
        ("", "'' is no description"),
        ("typical,,bias", "'' is no description"),
        ("-bias=2", "'-bias=2' is no description"),
        ("bias=2=3", "'bias=2=3' is no description"),
        ("bias=much", "The strength of bias is no number: 'much'"),
        ("bias=-1", "bias cannot have the strength -1.0"),
        ("bias=nan", "bias cannot have the strength nan"),
        ("bias=11", "bias cannot have the strength 11.0"),
        ("bias,typical", "typical stands behind other names"),
    ],
)
def test_nonsense_is_refused(text, what):
    with pytest.raises(SetupError, match=what.replace("(", r"\(")) as refused:
        parse(text)
    assert refused.value.remedy.endswith(".")


def test_strengths_are_kept_and_checked_in_files_too():
    assert msgspec.json.decode(msgspec.json.encode(HARSH), type=Imperfections) == HARSH
    with pytest.raises(SetupError):
        Imperfections(wobble=-0.5)
    with pytest.raises(SetupError, match="wobble cannot have the strength 99"):
        msgspec.json.decode(b'{"wobble": 99}', type=Imperfections)


def test_presets_are_what_they_are_called():
    assert set(told(IDEAL).values()) == {0.0}
    assert TYPICAL.dying_sensor == TYPICAL.magnet == 0.0
    assert all(harsh >= 1.0 for harsh in told(HARSH).values())
    assert all(told(HARSH)[name] >= strength for name, strength in told(TYPICAL).items())


def test_every_error_is_explained_once_and_belongs_to_at_most_one_group():
    assert tuple(source.name for source in TABLE) == NAMES
    assert all(source.what and source.size and source.source for source in TABLE)
    members = [name for group in GROUPS.values() for name in group]
    assert len(set(members)) == len(members)
    assert set(members) <= set(NAMES)
    assert not set(NAMES) & {*GROUPS, *PRESETS}


def test_the_table_of_the_documentation_is_this_one():
    documentation = Path(__file__).resolve().parents[2] / "docs" / "simulation.md"
    lines = documentation.read_text(encoding="utf-8").splitlines()
    for one in TABLE:
        assert f"| `{one.name}` | {one.what} | {one.size} | {one.source} |" in lines
    assert all(any(f"`{name}`" in line for line in lines) for name in [*GROUPS, *PRESETS])
