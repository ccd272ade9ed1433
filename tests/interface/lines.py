"""The public interface of a crate as lines of text, out of what `rustdoc --output-format json` says.

    python3 tests/interface/lines.py FILE.json

A line is one item: its path and its signature; a type has one more with the traits that it has. Hidden items are none.
"""

import json
import sys

OURS = "wstac_"  # paths of other crates are theirs to change: of those the last name is given


class Interface:
    """One crate's items, by the number that rustdoc gives them."""

    def __init__(self, document):
        self.items, self.paths = document["index"], document["paths"]
        self.lines = set()
        root = self.items[str(document["root"])]
        self.module(root, root["name"])

    # Types, as they are written.

    def name(self, path):
        known = self.paths.get(str(path["id"]))
        parts = known["path"] if known else path["path"].split("::")
        name = "::".join(parts) if parts[0].startswith(OURS) else parts[-1]
        return name + self.arguments(path.get("args"))

    def arguments(self, args):
        if not args:
            return ""
        if "parenthesized" in args:
            inputs, output = args["parenthesized"]["inputs"], args["parenthesized"]["output"]
            return f"({self.types(inputs)})" + (f" -> {self.type(output)}" if output else "")
        found = args["angle_bracketed"]
        parts = [self.argument(one) for one in found["args"]]
        for one in found["constraints"]:
            binding = one["binding"]
            if "equality" in binding:
                term = binding["equality"]
                parts.append(f"{one['name']} = {self.type(term['type']) if 'type' in term else term['constant']['expr']}")
            else:
                parts.append(f"{one['name']}: {self.bounds(binding['constraint'])}")
        return f"<{', '.join(parts)}>" if parts else ""

    def argument(self, one):
        if one == "infer":
            return "_"
        (kind, value), = one.items()
        return {"lifetime": lambda: value, "type": lambda: self.type(value), "const": lambda: value["expr"]}[kind]()

    def types(self, types):
        return ", ".join(self.type(one) for one in types)

    def type(self, type_):
        if type_ == "infer":
            return "_"
        (kind, value), = type_.items()
        mutable = "mut " if isinstance(value, dict) and value.get("is_mutable") else ""
        match kind:
            case "resolved_path":
                return self.name(value)
            case "generic" | "primitive":
                return value
            case "tuple":
                return f"({self.types(value)})"
            case "slice":
                return f"[{self.type(value)}]"
            case "array":
                return f"[{self.type(value['type'])}; {value['len']}]"
            case "borrowed_ref":
                lifetime = f"{value['lifetime']} " if value["lifetime"] else ""
                return f"&{lifetime}{mutable}{self.type(value['type'])}"
            case "raw_pointer":
                return f"*{mutable or 'const '}{self.type(value['type'])}"
            case "impl_trait":
                return f"impl {self.bounds(value)}"
            case "dyn_trait":
                traits = [self.name(one["trait"]) for one in value["traits"]]
                return "dyn " + " + ".join(traits + ([value["lifetime"]] if value["lifetime"] else []))
            case "qualified_path":
                trait = f" as {self.name(value['trait'])}" if value["trait"] else ""
                return f"<{self.type(value['self_type'])}{trait}>::{value['name']}"
            case "function_pointer":
                return f"fn{self.signature(value['sig'])}"
        raise ValueError(f"type is {kind}, expected one that this script knows")

    def bounds(self, bounds):
        parts = []
        for bound in bounds:
            (kind, value), = bound.items()
            if kind == "trait_bound":
                parts.append({"none": "", "maybe": "?"}.get(value["modifier"], "~const ") + self.name(value["trait"]))
            elif kind == "use":
                parts.append("use<" + ", ".join(next(iter(one.values())) for one in value) + ">")
            else:
                parts.append(value)
        return " + ".join(parts)

    def generics(self, generics):
        """Parameters in angle brackets, and the where clause."""
        parameters, where = [], []
        for one in generics["params"]:
            (kind, value), = one["kind"].items()
            if kind == "lifetime":
                parameters.append(one["name"])
            elif kind == "const":
                default = f" = {value['default']}" if value["default"] else ""
                parameters.append(f"const {one['name']}: {self.type(value['type'])}{default}")
            elif not value["is_synthetic"]:
                bounds = f": {self.bounds(value['bounds'])}" if value["bounds"] else ""
                default = f" = {self.type(value['default'])}" if value["default"] else ""
                parameters.append(one["name"] + bounds + default)
        for one in generics["where_predicates"]:
            if "bound_predicate" in one:
                found = one["bound_predicate"]
                where.append(f"{self.type(found['type'])}: {self.bounds(found['bounds'])}")
            else:
                where.append(json.dumps(one, sort_keys=True))
        return f"<{', '.join(parameters)}>" if parameters else "", f" where {', '.join(where)}" if where else ""

    def signature(self, sig):
        output = f" -> {self.type(sig['output'])}" if sig["output"] else ""
        return "(" + ", ".join(f"{name}: {self.type(type_)}" for name, type_ in sig["inputs"]) + ")" + output

    # Items.

    def inside(self, numbers, path):
        for number in numbers:
            if str(number) in self.items:
                self.item(self.items[str(number)], path)

    def module(self, item, path):
        self.inside(item["inner"]["module"]["items"], path)

    def item(self, item, path):
        (kind, inner), = item["inner"].items()
        if kind == "use":
            target = self.items.get(str(inner["id"]))
            if target is None:
                self.lines.add(f"{path}::{inner['name']}: use {inner['source']}")
            elif inner["is_glob"]:
                self.module(target, path)
            else:
                self.item({**target, "name": inner["name"]}, path)
            return
        path = f"{path}::{item['name']}"
        names = [next(iter(mark)) if isinstance(mark, dict) else mark for mark in item["attrs"]]
        marks = "".join(f"#[{name}] " for name in names if name in ("non_exhaustive", "must_use"))
        generics, where = self.generics(inner["generics"]) if isinstance(inner, dict) and "generics" in inner else ("", "")
        line = f"{path}{generics}: {marks}{self.what(kind, inner)}{where}"
        self.lines.add(line)
        if kind == "module":
            self.module(item, path)
        elif kind == "trait":
            self.inside(inner["items"], path)
        elif kind == "enum":
            self.inside(inner["variants"], path)
        elif kind == "variant":
            fields = inner["kind"]
            if isinstance(fields, dict) and "struct" in fields:
                self.inside(fields["struct"]["fields"], path)
        elif kind == "struct" and isinstance(inner["kind"], dict) and "plain" in inner["kind"]:
            self.inside(inner["kind"]["plain"]["fields"], path)
        if kind in ("struct", "enum"):
            self.implementations(inner["impls"], path)

    def what(self, kind, inner):
        match kind:
            case "function":
                words = [word for word in ("const", "async", "unsafe") if inner["header"][f"is_{word}"]]
                provided = "" if inner["has_body"] else " (to be given)"
                return " ".join([*words, "fn"]) + self.signature(inner["sig"]) + provided
            case "struct_field":
                return self.type(inner)
            case "constant":
                return f"const {self.type(inner['type'])} = {inner['const']['value'] or inner['const']['expr']}"
            case "static":
                return f"static {self.type(inner['type'])}"
            case "assoc_const":
                return f"const {self.type(inner['type'])}"
            case "assoc_type":
                return "type " + (self.type(inner["type"]) if inner["type"] else self.bounds(inner["bounds"]))
            case "type_alias":
                return f"type {self.type(inner['type'])}"
            case "variant" | "struct":
                fields = inner["kind"].get("tuple") if isinstance(inner["kind"], dict) else None
                if fields is None:
                    return kind
                types = ("_" if one is None else self.type(self.items[str(one)]["inner"]["struct_field"]) for one in fields)
                return f"{kind}({', '.join(types)})"
            case "trait":
                return "trait" + (f": {self.bounds(inner['bounds'])}" if inner["bounds"] else "")
            case "macro":
                return " ".join(inner.split())
        return kind

    def implementations(self, numbers, path):
        """A type's own functions, a line each; its traits in one line, without those that every type has."""
        traits = set()
        for number in numbers:
            inner = self.items[str(number)]["inner"]["impl"]
            if inner["trait"] is None:
                of = self.arguments(inner["for"]["resolved_path"]["args"])
                self.inside(inner["items"], path + of + self.generics(inner["generics"])[1])
            elif inner["blanket_impl"] is None:
                name = self.name(inner["trait"])
                # Only whether it can go to another thread; the other traits of that kind follow what it holds, too.
                if name != "StructuralPartialEq" and (not inner["is_synthetic"] or name in ("Send", "Sync")):
                    traits.add(("!" if inner["is_negative"] else "") + name)
        self.lines.add(f"{path} is: {', '.join(sorted(traits))}")


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        document = json.load(file)
    print("\n".join(sorted(Interface(document).lines)))


if __name__ == "__main__":
    main()
