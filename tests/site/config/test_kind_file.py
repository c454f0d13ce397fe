"""Files of kinds, as spreadsheets write them."""

from __future__ import annotations

from pathlib import Path

import pytest

from bimvox.bim.kinds.kind import Correction, Kind
from bimvox.errors import ConfigError
from bimvox.site.config.kind_file import corrections_in

PATH = Path("kinds.csv")
HEAD = "set_kind,set_means,parts,select\n"


def read(text: str | bytes) -> list[tuple[str, Kind | None, str | None]]:
    data = text if isinstance(text, bytes) else text.encode()
    return [(one.select, one.kind, one.means) for one in corrections_in(data, PATH)]


def test_only_rows_in_which_something_is_written_count():
    text = HEAD + 'timber,,3,"IfcWall, type=""A"""\n,,4,IfcBeam\n,built,5,IfcSlab\n'
    assert read(text) == [('IfcWall, type="A"', Kind.TIMBER, None), ("IfcSlab", None, "built")]
    assert corrections_in(text.encode(), PATH)[0] == Correction(
        'IfcWall, type="A"', Kind.TIMBER, None, "kinds.csv: line 2"
    )


@pytest.mark.parametrize(
    "data",
    [
        '\ufeffset_kind;set_means;from_kg;select\r\ntimber;built;1,5;"Wände, 2"\r\n'.encode(),
        "set_kind\tset_means\tselect\r\ntimber\tbuilt\tWände, 2\r\n".encode("utf-16"),
        "sep=;\nset_kind;set_means;select\ntimber;built;Wände, 2\n".encode("cp1252"),
        'Select , SET_KIND,set_means\n"Wände, 2",Timber,Built \n'.encode(),
    ],
)
def test_separators_encodings_and_the_order_of_columns_are_those_of_any_spreadsheet(data):
    assert read(data) == [("Wände, 2", Kind.TIMBER, "built")]


def test_the_words_of_the_printed_table_are_understood():
    assert read(HEAD + "unknown,by hand,1,A\n,cast,1,B\n,In situ,1,C\n") == [
        ("A", Kind.OTHER, "by_hand"),
        ("B", None, "in_situ"),
        ("C", None, "in_situ"),
    ]


def test_every_bad_row_is_named_by_line_and_column_with_what_may_stand_there():
    with pytest.raises(ConfigError) as caught:
        read(HEAD + "timbre,,1,A\nsteel,crain,1,B\nsteel,,1,\n")
    assert str(caught.value).splitlines()[:3] == [
        "kinds.csv: line 2, column set_kind: 'timbre' is not one of precast, concrete, masonry, timber, steel, light, "
        "glazing, formwork, pile, earth, other; did you mean timber?",
        "  line 3, column set_means: 'crain' is not one of crane, in_situ, built, by_hand, out; did you mean crane?",
        "  line 4, column select: it is empty: keep what bimvox wrote there",
    ]


def test_two_rows_of_one_type_must_say_the_same():
    assert read(HEAD + "timber,,1,A\ntimber,,2,A\n") == [("A", Kind.TIMBER, None)]
    with pytest.raises(ConfigError, match="line 3: line 2 says something else of the same type"):
        read(HEAD + "timber,,1,A\nsteel,,2,A\n")


@pytest.mark.parametrize("text", ["", "a,b,c\n1,2,3\n", "set_kind,select\ntimber,A\n"])
def test_another_table_is_refused_with_the_columns_that_it_lacks(text):
    with pytest.raises(ConfigError, match=r"kinds\.csv: line 1: has no column"):
        read(text)


def test_many_bad_rows_are_counted():
    with pytest.raises(ConfigError, match="and 7 more rows"):
        read(HEAD + "x,,1,A\n" * 12)


def test_lines_within_quotes_and_short_rows_count_as_lines():
    with pytest.raises(ConfigError, match="line 4, column set_kind"):
        read(HEAD + ',,"two\nlines",A\nx,,1,A\n')
    assert read(HEAD + "timber\n"[:0] + ",\n") == []
