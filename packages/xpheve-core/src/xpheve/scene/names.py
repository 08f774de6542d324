"""How the tables of a scene file call one another: by name, by id, or by place."""

from __future__ import annotations

import re
from collections.abc import Sequence

_PLACE = re.compile(r"^(.*)#([1-9][0-9]{0,8})$", re.DOTALL)


class Names:
    """The tables of one kind, each with its name and id, either of which may be empty.

    A table is called by its name; by its id, if it is the only one of it; or by its place in the file: ``"#2"`` is the
    second table, ``"basic:spring#2"`` the second of that id.
    """

    def __init__(self, rows: Sequence[tuple[str, str]]) -> None:
        self.rows = rows
        self._by_name: dict[str, int] = {}
        self._by_id: dict[str, list[int]] = {}
        self.twice: list[tuple[int, int]] = []
        """Pairs of tables of one name."""
        for place, (name, id) in enumerate(rows):
            if name:
                if name in self._by_name:
                    self.twice.append((self._by_name[name], place))
                self._by_name.setdefault(name, place)
            if id:
                self._by_id.setdefault(id, []).append(place)

    def find(self, word: str) -> int:
        """Return the place of the table called ``word``, from 0; -1 if there is none, -2 if there are several."""
        if word in self._by_name:
            return self._by_name[word]
        if word in self._by_id:
            return self._by_id[word][0] if len(self._by_id[word]) == 1 else -2
        match = _PLACE.match(word)
        if match:
            places = self._by_id.get(match[1], []) if match[1] else range(len(self.rows))
            number = int(match[2])
            if number <= len(places):
                return places[number - 1]
        return -1

    def called(self, place: int) -> str:
        """Return the shortest word that `find` takes for the table at ``place``; empty if others' names leave none."""
        name, id = self.rows[place]
        among = self._by_id[id].index(place) + 1 if id else 0
        for word in (name, id, f"{id}#{among}" if id else "", f"#{place + 1}"):
            if word and self.find(word) == place:
                return word
        return ""

    def known(self) -> list[str]:
        """All names and ids, for errors."""
        return [*self._by_name, *self._by_id]
