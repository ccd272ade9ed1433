"""Tests which circles circles.py finds, on small trees."""

import unittest
from pathlib import Path

import circles


class Circles(unittest.TestCase):
    def circles(self, forgiven=(), **texts):
        """Returns what is wrong in a crate; `a__b` is the file a/b.rs. The folders a and c have a module each."""
        texts = {"lib": "pub mod a;\npub mod c;\n", "a__mod": "pub mod b;\n", "c__mod": "pub mod d;\n", "c__d": "use crate::a::b::B;\n"} | texts
        sources = {f"wstac-x/src/{name.replace('__', '/')}.rs": text for name, text in texts.items()}
        return circles.wrong_circles(sources, [Path("wstac-x")], dict.fromkeys(forgiven, "a reason"))[0]

    def test_a_way_back_is_a_circle(self):
        for text in (
            "use crate::c::d::D;",
            "use crate::c::{\n    e,\n    d::{self, D as Other},\n};",
            "pub use super::super::c::d::D;",
            "fn f() {\n    crate::c::d::f();\n}",
            "use crate::c;\nfn f() -> c::d::D {}",
            "mod inner {\n    fn f() {\n        super::super::super::c::d::f();\n    }\n}",
        ):
            (wrong,) = self.circles(a__b=text)
            self.assertRegex(wrong, r'a/b.rs uses \S+ of c/d.rs, which uses crate::a::b::B of a/b.rs: .*"wstac-x: a, c"', text)

    def test_the_way_may_be_long_and_the_shortest_is_told(self):
        texts = {"a__b": "use super::e::E;", "a__e": "use crate::c::d::D;", "c__d": "use crate::a::b::B;\nuse crate::c::g::G;", "c__g": "use crate::a::e::E;\nuse super::d::D;"}
        (wrong,) = self.circles(**texts)
        self.assertEqual(wrong.count(" uses "), 3)

    def test_re_exports_lead_to_the_file_that_defines_the_name(self):
        for export, text in (("pub use d::D;", "use crate::c::D;"), ("pub use d::*;", "use crate::c::D;"), ("pub use d::D as E;", "fn f() {\n    crate::c::E::g();\n}")):
            self.assertEqual(len(self.circles(a__b=text, c__mod=f"pub mod d;\n{export}\n", c__d="use crate::a::b::B;\npub struct D;\n")), 1, export)
        self.assertEqual(self.circles(a__b="use crate::c::D;", c__mod="pub mod d;\npub use d::E;\npub struct D;\n"), [])

    def test_no_uses(self):
        for text in (
            "use super::e::E;",
            "use std::c::d::D;",
            "// use crate::c::d::D;\n/// [`crate::c::d::D`]",
            'const A: &str = "crate::c::d::D";',
            "#[cfg(test)]\nuse crate::c::d::{D, E};\n",
            "#[cfg(test)]\nmod tests {\n    use crate::c::d::D;\n}\n",
        ):
            self.assertEqual(self.circles(a__b=text), [], text)
        self.assertEqual(self.circles(a__tests="use crate::c::d::D;", c__d="use crate::a::tests::f;\n"), [])

    def test_a_module_may_use_its_ancestors_and_those_of_its_folder(self):
        common = {"c__d": "use super::C;\nuse crate::A;\nuse super::e;\n", "c__e": "use super::d;", "c__mod": "mod d;\npub use d::D;\npub struct C;\nfn f(d: d::D) {}\n"}
        self.assertEqual(self.circles(lib="use c::d::D;\npub struct A;\n", **common), [])

    def test_forgiven_circles_are_needed(self):
        self.assertEqual(self.circles(["wstac-x: a, c"], a__b="use crate::c::d::D;"), [])
        (wrong,) = self.circles(["wstac-x: a, c"], a__b="")
        self.assertIn('no circle "wstac-x: a, c"', wrong)


if __name__ == "__main__":
    unittest.main()
