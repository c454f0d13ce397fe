"""Words of materials from open dictionaries, into ``bimvox/bim/kinds/open_words.toml``.

``python -m supply.words FOLDER``: FOLDER holds the tables of the Open Multilingual Wordnet (``wn-data-*.tab`` and,
from Wiktionary, ``wn-wikt-*.tab``; https://github.com/omwn/omw-data). What a word means is the entry of ``words.toml``
that names its synset. A word is left out if ``words.toml`` knows it already, if it is too short to be told from others,
if it stands under two kinds, or if a language in which many models are named has it for something else.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from bimvox.bim.kinds.words import meaning_of, plain

_KINDS = Path(__file__).parents[1] / "bimvox" / "bim" / "kinds"
_FREE = re.compile(r"wordnet|MIT|Apache|ODC-BY|CC[ -]BY", re.IGNORECASE)
"""Licences under which a list of single words may be passed on, with its source."""
_OFTEN = ("deu", "eng", "fra", "ita", "nld", "por", "spa")
"""Languages in which many models are named: words.toml has theirs, and a word means what it means there."""
_NOBODYS = ("epo", "ido", "ina", "lat", "nov", "vol")
"""Languages in which no building is drawn."""
_LEAST_LETTERS, _LEAST_SIGNS, _MOST_WORDS, _LEAST_MEANINGS = 4, 2, 3, 2
_SIGNS = re.compile(r"[぀-ヿ㐀-鿿가-힯]")
_PLAIN_WORD = re.compile(r"[^\W\d_]+(?:[ '’-][^\W\d_]+)*")
_HEAD = """\
# Words of materials from open dictionaries, made by `python -m supply.words FOLDER`; its text says how they are chosen.
# They decide only where no word of words.toml does. Correct a word there: a word that is there is left out here.
# Single words with what they mean are passed on under the licence of their source, the dictionary of their language.

[sources]
"""


def tables(folder: Path) -> Iterator[tuple[str, str, dict[str, set[str]]]]:
    """Yield every table of a folder: its language, its source with the licence, and its words by synset."""
    for path in sorted(folder.rglob("wn-*.tab")):
        lines = path.read_text(encoding="utf-8").splitlines()
        head = [cell.strip() for cell in lines[0].removeprefix("#").split("\t")] if lines else []
        found: dict[str, set[str]] = defaultdict(set)
        for line in lines[1:]:
            cells = line.split("\t")
            if len(cells) == 3 and cells[1].endswith("lemma"):
                found[cells[0]].add(cells[2].strip())
        if len(head) >= 4 and _FREE.search(head[3]):
            yield head[1], f"{head[0]}, {head[3]}, {head[2]}", found


def renewed(folder: Path) -> str:
    """Return the text of ``open_words.toml``."""
    entries = tomllib.loads((_KINDS / "words.toml").read_text(encoding="utf-8"))["material"]
    name_of = {synset.strip(): entry["name"] for entry in entries for synset in entry.get("synsets", "").split(",")}
    kind_of = {entry["name"]: entry["kind"] for entry in entries}
    name_of.pop("", None)
    words: dict[str, dict[str, set[str]]] = defaultdict(lambda: defaultdict(set))
    sources: dict[str, set[str]] = defaultdict(set)
    elsewhere: dict[str, bool] = {}
    for language, source, found in tables(folder):
        for synset, name in () if language in (*_OFTEN, *_NOBODYS) else name_of.items():
            for word in found.get(synset, ()):
                if _is_usable(word):
                    words[language][name].add(word.casefold())
                    sources[language].add(source)
        if language in _OFTEN:
            for synset, lemmas in found.items():
                for word in map(plain, lemmas):
                    elsewhere[word] = elsewhere.get(word, False) or synset in name_of
    kinds: dict[str, set[str]] = defaultdict(set)
    for own in words.values():
        for name, some in own.items():
            for word in some:
                kinds[plain(word)].add(kind_of[name])

    def stays(word: str) -> bool:
        bare = plain(word)
        return len(kinds[bare]) == 1 and elsewhere.get(bare, True) and meaning_of(word, dictionaries=False) is None

    kept = {
        language: {name: sorted(filter(stays, some)) for name, some in sorted(own.items())}
        for language, own in sorted(words.items())
        if len(own) >= _LEAST_MEANINGS
    }
    kept = {language: own for language, own in kept.items() if any(own.values())}
    text = _HEAD + "".join(f'{language} = "{"; ".join(sorted(sources[language]))}"\n' for language in kept)
    for name in dict.fromkeys(name_of.values()):
        text += f'\n[[material]]\nname = "{name}"\n'
        text += "".join(f'{language} = "{", ".join(own[name])}"\n' for language, own in kept.items() if own.get(name))
    return text


def _is_usable(word: str) -> bool:
    letters = plain(word)
    least = _LEAST_SIGNS if _SIGNS.search(word) else _LEAST_LETTERS
    return bool(len(letters) >= least and len(letters.split()) <= _MOST_WORDS and _PLAIN_WORD.fullmatch(word))


if __name__ == "__main__":
    (_KINDS / "open_words.toml").write_text(renewed(Path(sys.argv[1])), encoding="utf-8", newline="\n")
