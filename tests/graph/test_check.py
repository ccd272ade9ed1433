"""Tests what check.py refuses, each by an example."""

import tempfile
import unittest
from pathlib import Path

import check
import lines

RULES = {
    "arrows": {"low": [], "middle": ["low"], "high": ["middle"]},
    "build": {"low": ["middle"]},
    "tests": {},
    "crates": {"low": {"features": "none", "fewer_than": 3}},
}


def package(name, arrows=(), build=(), tests=(), folder=None):
    """Returns a package that depends on these."""
    needs = {"arrows": set(arrows), "build": set(build), "tests": set(tests)}
    return name, check.Package(name, Path(folder or name), needs)


def arrows(*packages):
    return "\n".join(check.wrong_arrows(dict(packages), RULES))


def files(**texts):
    """Returns what is wrong in files. Each is named by its package: `low` is the file low/src/lib.rs."""
    sources = {f"{name}/src/lib.rs": text for name, text in texts.items()}
    folders = {Path("low"), Path("high"), Path("tests")}
    return "\n".join(check.wrong_in_files(sources, folders, folders - {Path("tests")}))


class Lines(unittest.TestCase):
    SOURCES = {
        "wstac-a/src/lib.rs": "//! About.\n\n/// One.\npub fn one() {}\n#[cfg(test)]\nmod helper;\n#[cfg(test)]\nmod tests {\n    fn two() {}\n}\n",
        "wstac-a/src/helper.rs": "fn only_for_tests() {}\n",
        "wstac-a/src/tests.rs": "fn three() {}\n",
        "wstac-b/page.js": "// About.\n\nlet four;\n",
        "tests/five.rs": "fn five() {}\n",
        "tests/six.py": '"""About.\n\nMore."""\nsix = """\ntwo"""\n"""Which six."""\n\n\ndef of():\n    """Returns it."""\n    return six\n',
        "ci/graph": "#!/bin/bash\n# About.\nthree\n",
        "tests/seven": "no script\n",
    }

    def test_code_alone_is_counted(self):
        rust, other = lines.counted(self.SOURCES)
        self.assertEqual((dict(rust), dict(other)), ({"wstac-a": 3}, {"other languages": 1, "tests and ci": 12}))

    def test_a_room_above_its_limit_is_wrong(self):
        counted = lines.counted(self.SOURCES)
        budgets = {"wstac-a": {"most": 3, "goal": 2}, "other languages": {"most": 1, "goal": 1}, "tests and ci": {"most": 12, "goal": 7}}
        self.assertEqual(lines.wrong_rooms(*counted, budgets)[0], [])
        budgets["wstac-a"]["most"] = 2
        self.assertIn("wstac-a: 3 lines of code, expected at most 2", lines.wrong_rooms(*counted, budgets)[0])
        del budgets["wstac-a"]
        budgets["wstac-c"] = {"most": 1, "goal": 1}
        self.assertEqual(len(lines.wrong_rooms(*counted, budgets)[0]), 2)

    def test_a_long_function_is_wrong_unless_it_is_allowed(self):
        def text(length):
            return "fn short(a: [u8; 3]);\nfn long(\n    a: [u8; 3],\n) {\n" + "    a();\n" * length + "}\nfn next() {}\n"

        place = "wstac-a/src/lib.rs:long"
        self.assertEqual(lines.wrong_lengths({"wstac-a/src/lib.rs": text(96)}, {}), [])
        self.assertEqual(len(lines.wrong_lengths({"wstac-a/src/lib.rs": text(98)}, {})), 1)
        self.assertEqual(lines.wrong_lengths({"wstac-a/src/lib.rs": text(98)}, {place: "why"}), [])
        self.assertEqual(len(lines.wrong_lengths({"wstac-a/src/lib.rs": text(1)}, {place: "why"})), 1)


class Arrows(unittest.TestCase):
    def test_down_is_right(self):
        self.assertEqual(arrows(package("low"), package("middle", ["low"]), package("high", ["middle", "low"])), "")

    def test_up_is_wrong(self):
        self.assertIn("low depends on high (arrows)", arrows(package("low", ["high"]), package("high")))

    def test_build_scripts_and_tests_have_their_own_rules(self):
        self.assertEqual(arrows(package("low", build=["middle"]), package("middle")), "")
        self.assertIn("low depends on middle (tests)", arrows(package("low", tests=["middle"]), package("middle")))

    def test_circle_is_wrong_even_through_tests(self):
        self.assertIn("middle depends on itself", arrows(package("low", tests=["middle"]), package("middle", ["low"])))

    def test_every_room_has_a_line(self):
        self.assertIn("other has no line", arrows(package("other")))
        self.assertEqual(arrows(package("other", ["low"], folder="tests/other"), package("low")), "")

    def test_manifests_are_read(self):
        with tempfile.TemporaryDirectory() as folder:
            text = '[package]\nname = "middle"\n[dependencies]\nserde = "1"\nlow = { path = "../low" }\n'
            text += '[target.x.dev-dependencies]\nhelper = { path = "../helper", package = "real" }\n'
            (Path(folder) / "Cargo.toml").write_text(text, encoding="utf-8")
            (found,) = check.packages(Path(folder), ["Cargo.toml"]).values()
        self.assertEqual((found.name, found.needs), ("middle", {"arrows": {"low"}, "build": set(), "tests": {"real"}}))


class Files(unittest.TestCase):
    def test_a_package_has_its_own_modules(self):
        self.assertEqual(files(low='#[path = "../build/a.rs"]\nmod a;'), "")
        self.assertIn("low/src/lib.rs:1: #[path] of high/src/a.rs", files(low='#[path = "../../high/src/a.rs"]\nmod a;'))
        self.assertIn("include! of tests/a.txt", files(low='const A: &str = include_str!("../../tests/a.txt");'))

    def test_public_is_documented(self):
        hidden = "#[doc(hidden)]\n#[must_use]\npub const fn secret() {}"
        self.assertIn("secret is public and hidden", files(low=hidden))
        self.assertEqual(files(low=hidden + "\n#[macro_export]\nmacro_rules! m { () => { $crate::secret() } }"), "")
        self.assertEqual(files(low="#[doc(hidden)]\nfn of_a_trait();"), "")

    def test_memory_has_an_owner(self):
        self.assertIn("never freed", files(low="let a = Box::leak(b);"))
        self.assertIn("never freed", files(low="let a = b.leak();"))
        self.assertEqual(files(low="// never Box::leak", tests="let a = Box::leak(b);"), "")

    def test_nothing_points_to_itself(self):
        for text in ("unsafe { transmute::<&A, &'static A>(a) }", "struct A {\n    own: *const Self,\n}", "    pub own: NonNull<Self>,", "let a: &'static B = unsafe { &*self.0 };"):
            self.assertIn("points to itself", files(high=text))


class Sentences(unittest.TestCase):
    def wrong(self, text, name="low/src/lib.rs", foreign=()):
        return check.wrong_sentences({name: text}, {Path("low")}, dict.fromkeys(foreign, "a reason"))

    def test_no_comparison(self):
        for text in (
            'why == "left alone"',
            '"left alone" != why',
            'why.contains("left alone")',
            'why.starts_with(\n    "left alone")',
            'why.split("; left alone").next()',
            '["never", "left alone"].contains(&why)',
            'matches!(why, Some("left alone"))',
            'match why { "left alone" => 1, _ => 2 }',
            'match why { Some("never" | "left alone") => 1, _ => 2 }',
            'match why { "left alone" | "never" if known => 1, _ => 2 }',
            'match (why, 1) { ("left alone", number) => 1, _ => 2 }',
            'if let Some("left alone") = why {}',
            'why == r#"left alone"#',
        ):
            (wrong,) = self.wrong(f"fn f() {{\n    {text}\n}}")
            self.assertRegex(wrong, r'low/src/lib.rs:[23]: compares the sentence ".*left alone"')

    def test_words_and_texts_are_right(self):
        for text in (
            'why == "left"',
            'text.split(", ")',
            '// why == "left alone"',
            'match why { Kept => "left alone", Other(words) => words }',
            'assert!(matches!(why, Kept), "left alone");',
            'let text = "why == left alone";',
            'let Some(x) = f("left alone") else { return };',
            "let a = ['\"', ' ']; why == b",
        ):
            self.assertEqual(self.wrong(text), [], text)

    def test_tests_may(self):
        text = 'why == "left alone"'
        self.assertEqual(self.wrong(f"#[cfg(test)]\nmod tests {{\n    fn f() {{ {text} }}\n}}\n"), [])
        self.assertEqual(len(self.wrong(f"#[cfg(test)]\nmod tests {{\n}}\nfn f() {{ {text} }}")), 1)
        for name in ("low/src/a/tests.rs", "low/tests/a.rs", "low/examples/a.rs", "high/src/lib.rs"):
            self.assertEqual(self.wrong(text, name), [])

    def test_foreign_words_have_a_line_that_is_needed(self):
        foreign = [("low/src/lib.rs", "left alone")]
        self.assertEqual(self.wrong('why == "left alone"', foreign=foreign), [])
        self.assertEqual(len(self.wrong('why == "left over"', foreign=foreign)), 2)


class Names(unittest.TestCase):
    def wrong(self, exceptions=(), **texts):
        found = dict([package("low"), package("tests", folder="tests/low")])
        sources = {"low/src/lib.rs": "pub struct A;", "tests/low/src/lib.rs": "pub struct B;\nmod c {\n    pub enum B {}\n}"}
        sources |= {f"low/src/{name}.rs": text for name, text in texts.items()}
        return check.wrong_names(sources, found, {"low": dict.fromkeys(exceptions, "a reason")})

    def test_a_name_is_one_types(self):
        self.assertEqual(self.wrong(a="pub struct B;\nstruct A;\npub(crate) type A = u8;\n// pub type A\nimpl C for B { type A = u8; }"), [])
        for kind in ("pub enum A {}", "    pub trait A {}", "pub type A = u8;", "pub struct A<T>(T);"):
            (wrong,) = self.wrong(a=f"\n{kind}")
            self.assertIn("low/src/a.rs:2, low/src/lib.rs:1: 2 public types A", wrong)

    def test_tests_and_programs_may_repeat_it(self):
        texts = {"bin/a": "pub struct A;", "a/tests": "pub struct A;", "b": "#[cfg(test)]\nmod tests {\n    pub struct A;\n}\n"}
        self.assertEqual(self.wrong(**texts), [])

    def test_exceptions_are_needed(self):
        self.assertEqual(self.wrong(["A"], a="pub struct A;"), [])
        (wrong,) = self.wrong(["A"])
        self.assertIn("has no two types A", wrong)


class SharedNames(unittest.TestCase):
    def wrong(self, *texts, exceptions=()):
        sources = {f"low/src/{number}.rs": text for number, text in enumerate(texts)}
        return check.wrong_shared_names(sources, {Path("low")}, dict.fromkeys(exceptions, "a reason"))

    def test_a_name_belongs_to_types_of_three_files_at_most(self):
        three = ["struct A;", "pub(super) enum A {}", "trait A {}\nmod b {\n    struct A;\n}"]
        elsewhere = ["type A = u8;", "// struct A", "#[cfg(test)]\nmod tests {\n    struct A;\n}\n"]
        self.assertEqual(self.wrong(*three, *elsewhere), [])
        (wrong,) = self.wrong(*three, "    pub unsafe trait A {}")
        self.assertIn("low/src/3.rs: types A in 4 files, expected at most 3", wrong)

    def test_exceptions_are_needed(self):
        self.assertEqual(self.wrong(*["struct A;"] * 4, exceptions=["A"]), [])
        (wrong,) = self.wrong("struct A;", exceptions=["A"])
        self.assertIn("A is the name of at most 3 types", wrong)


class Counts(unittest.TestCase):
    def wrong(self, normal, build=(), links=None):
        trees = lambda _, __, edges, *___: set(normal) | (set(build) if "build" in edges else set())
        return "\n".join(check.wrong_counts(RULES, links or {}, trees)[0])

    def test_budget(self):
        self.assertEqual(self.wrong({"low v1", "a v1"}), "")
        self.assertIn("3 crates, expected fewer than 3", self.wrong({"low v1", "a v1", "b v1"}))

    def test_no_c(self):
        self.assertIn("needs cc", self.wrong({"low v1"}, {"cc v1"}))
        self.assertIn("needs z-sys", self.wrong({"low v1", "z-sys v1"}))
        self.assertIn("links the library z", self.wrong({"low v1", "a v1"}, links={"a v1": "z"}))

    def test_libclang(self):
        found = dict([package("low"), package("middle", ["low"]), package("high", ["middle"])])
        clang = lambda *_: {"clang-sys v1"}
        wrong = check.wrong_libclang(found, {"low"}, clang)
        self.assertEqual(wrong, ["low: needs clang-sys, expected no libclang"])
        self.assertEqual(check.wrong_libclang(found, {"low"}, lambda *_: {"libm v1"}), [])

    def test_columns_of_python(self):
        long = "x" * 121
        sources = {"wstac-a/b.py": f"{long}\n# type: ignore[import]{long}\n{long[1:]}\n", "tests/b.py": long}
        self.assertEqual(check.long_python(sources), ["wstac-a/b.py:1: has more than 120 columns"])


if __name__ == "__main__":
    unittest.main()
