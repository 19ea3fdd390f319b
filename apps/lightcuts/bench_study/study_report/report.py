"""What a run of the study found, read from its folder."""

import json
import pathlib


class Report:
    """The tables, facts and pictures of DIR/study.json."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.data = json.loads((self.folder / "study.json").read_text(encoding="utf-8"))
        self.facts = self.data["facts"]
        self.plots = self.folder / "plots"
        self.plots.mkdir(exist_ok=True)

    def rows(self, table, **wanted):
        """Rows of a table as dictionaries, those that have the wanted values."""
        found = self.data["tables"].get(table)
        if not found:
            return []
        rows = [dict(zip(found["columns"], row)) for row in found["rows"]]
        return [r for r in rows if all(r.get(k) == v for k, v in wanted.items())]

    def measured(self, table, **wanted):
        return self.rows(table, source="measured", **wanted)

    def published(self, table, **wanted):
        return self.rows(table, source="published", **wanted)

    def pictures(self, ids):
        """The pictures of these names that the run made, in this order."""
        known = {p["id"]: p for p in self.data["pictures"]}
        return [known[i] for i in ids if i in known and (self.folder / known[i]["file"]).exists()]
