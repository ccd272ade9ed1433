"""Tests the stack analysis on small pieces of disassembly. The expected bytes are counted by hand."""

import unittest

import stack
from disassembly import Unclear, parse
from walk import Analysis


def use(text, address=0):
    """Returns the stack of a function. A line of code is `address: name operands`, or a label. The bytes of an
    instruction do not matter.
    """
    lines = []
    for line in text.strip().splitlines():
        line = line.strip()
        if line.endswith(">:"):
            lines.append(line)
        else:
            at, _, code = line.partition(": ")
            name, _, operands = code.partition(" ")
            lines.append(f"    {at}:\t0000      \t{name}\t{operands}")
    return Analysis(parse("\n".join(lines))).use(address)


LEAF = """
    00000100 <leaf>:
    100: push {r4, r5, r6, lr}
    102: pop {r4, r5, r6, pc}
"""


class Taken(unittest.TestCase):
    def test_what_is_pushed_and_subtracted(self):
        code = """
            00000000 <f>:
            0: push {r4, r5, r6, r7, lr}
            2: add r7, sp, #12
            4: stmdb sp!, {r8, r9, sl, fp}
            8: vpush {d8-d10}
            c: sub sp, #340 @ 0x154
            e: subw sp, sp, #1604 @ 0x644
            10: addw sp, sp, #1604
            14: add sp, #340
            16: vpop {d8-d10}
            1a: ldmia.w sp!, {r8, r9, sl, fp}
            1e: pop {r4, r5, r6, r7, pc}
        """
        self.assertEqual(use(code).bytes, 20 + 16 + 24 + 340 + 1604)

    def test_single_precision_registers_and_ranges(self):
        self.assertEqual(use("00000000 <f>:\n0: vpush {s16-s19}\n4: push {r0-r3, lr}\n6: udf #254").bytes, 16 + 20)

    def test_a_store_that_writes_the_stack_pointer_back(self):
        code = """
            00000000 <f>:
            0: str.w fp, [sp, #-4]!
            4: strd r0, r1, [sp, #-8]!
            8: ldrd r0, r1, [sp], #8
            c: ldr.w fp, [sp], #4
            10: bx lr
        """
        self.assertEqual(use(code).bytes, 12)
        self.assertTrue(use(code).returns)

    def test_registers_read_and_written_at_a_stack_pointer_that_stays(self):
        code = """
            00000000 <f>:
            0: sub sp, #16
            2: stmia.w sp, {r0, r1, r2, r3}
            6: ldmia.w sp, {r0, r1, r2, r3}
            a: add sp, #16
            c: bx lr
        """
        self.assertEqual(use(code).bytes, 16)

    def test_a_large_frame_of_a_cortex_m0(self):
        code = """
            00000000 <f>:
            0: push {r4, r5, r6, r7, lr}
            2: add r7, sp, #12
            4: ldr r6, [pc, #160] @ (20 <f+0x20>)
            6: add sp, r6
            8: subs r6, r7, #7
            a: subs r6, #5
            c: mov sp, r6
            e: pop {r4, r5, r6, r7, pc}
            20: .word 0xfffffb58
        """
        self.assertEqual(use(code).bytes, 20 + 1192)

    def test_back_to_the_frame_that_r7_points_to(self):
        for back in ("sub.w sp, r7, #12", "mov sp, r7\n9: sub sp, #12", "subs r4, r7, #8\n9: subs r4, #4\na: mov sp, r4"):
            code = f"""
                00000000 <f>:
                0: push {{r4, r6, r7, lr}}
                2: add r7, sp, #8
                4: str.w r8, [sp, #-4]!
                6: sub sp, #48
                8: {back}
                c: push {{r0, r1, r2, r3, r4, r5, r6, r7, r8, r9, sl, fp, ip}}
                e: udf #254
            """
            with self.subTest(back):
                # 20 bytes are left, and 52 are added.
                self.assertEqual(use(code).bytes, 72)

    def test_an_unknown_change_is_an_error(self):
        for code in ("mov sp, r4", "add sp, r6", "bic.w sp, sp, #7", "ldr sp, [r0]", "sub.w sp, sp, r4", "msr MSP, r0", "ldm sp!, {r4}", "ldmia.w sp, {r4, sp}", "sub.w sp, r4, #8"):
            with self.subTest(code), self.assertRaisesRegex(Unclear, code.split()[-1]):
                use(f"00000000 <f>:\n0: {code}\n4: bx lr")

    def test_more_given_back_than_taken_is_an_error(self):
        with self.assertRaisesRegex(Unclear, "more is given back"):
            use("00000000 <f>:\n0: push {r4, lr}\n2: pop {r4, r5, pc}")


class Paths(unittest.TestCase):
    def test_a_call_takes_what_is_deep_there(self):
        code = """
            00000000 <f>:
            0: push {r7, lr}
            2: bl 100 <leaf>
            6: sub sp, #64
            8: add sp, #64
            a: pop {r7, pc}
        """
        # The call comes before the 64 bytes.
        self.assertEqual(use(code + LEAF).bytes, 8 + 64)
        deeper = use(code.replace("#64", "#8") + LEAF)
        self.assertEqual((deeper.bytes, deeper.path), (8 + 16, ("f", "leaf")))

    def test_a_tail_call_takes_the_callers_place(self):
        code = "00000000 <f>:\n0: push {r4, lr}\n2: ldmia.w sp!, {r4, lr}\n6: b.w 100 <leaf>"
        self.assertEqual((use(code + LEAF).bytes, use(code + LEAF).path), (16, ("f", "leaf")))
        self.assertTrue(use(code + LEAF).returns)

    def test_a_conditional_return_goes_on_as_deep(self):
        code = """
            00000000 <f>:
            0: push {r4, lr}
            2: itt eq
            4: addeq r0, #1
            6: popeq {r4, pc}
            8: sub sp, #16
            a: add sp, #16
            c: pop {r4, pc}
        """
        self.assertEqual(use(code).bytes, 24)

    def test_both_sides_of_a_branch(self):
        code = """
            00000000 <f>:
            0: cbz r0, 6 <f+0x6>
            2: push {r4, lr}
            4: pop {r4, pc}
            6: bls.n a <f+0xa>
            8: bx lr
            a: push {r4, r5, lr}
            c: pop {r4, r5, pc}
        """
        self.assertEqual(use(code).bytes, 12)

    def test_two_depths_at_one_place_are_an_error(self):
        with self.assertRaisesRegex(Unclear, "4 or 0|0 or 4"):
            use("00000000 <f>:\n0: cbz r0, 4 <f+0x4>\n2: push {lr}\n4: bx lr")

    def test_the_cases_of_a_table_of_jumps(self):
        code = """
            00000000 <f>:
            0: push {r4, lr}
            2: tbb [pc, r0]
            6: .short 0x0301
            8: pop {r4, pc}
            a: sub sp, #24
            c: add sp, #24
            e: pop {r4, pc}
            10: nop
        """
        self.assertEqual(use(code).bytes, 32)

    def test_a_jump_worked_out_from_an_address_of_its_own(self):
        code = """
            00000000 <f>:
            0: add r6, pc, #8
            2: orr.w r6, r6, #1
            6: bx r6
            8: push {r4, r5}
            a: pop {r4, r5}
            c: bx lr
        """
        self.assertEqual((use(code).bytes, use(code).indirect), (8, set()))

    def test_a_kernel_by_hand_jumps_to_places_of_its_own(self):
        code = """
            00000000 <wstac_core::green::byte_sums::packed::add>:
            0: push {r4, r5, lr}
            2: bx r6
            4: ldr.w pc, [sp]
            8: pop {r4, r5, pc}
        """
        found = use(code)
        self.assertEqual((found.bytes, found.indirect, found.returns), (12, set(), True))
        with self.assertRaisesRegex(Unclear, "unknown jump"):
            use("00000000 <f>:\n0: push {r4, r5, lr}\n2: ldr.w pc, [sp]")
        self.assertEqual(use("00000000 <f>:\n0: push {r4, lr}\n2: bx r6").indirect, {"f at 2: bx r6"})

    def test_a_long_jump_of_a_cortex_m0_is_no_call(self):
        code = """
            00000000 <f>:
            0: push {r4, lr}
            2: bl 8 <f+0x8>
            6: udf #254
            8: sub sp, #8
            a: add sp, #8
            c: pop {r4, pc}
        """
        self.assertEqual(use(code).bytes, 16)

    def test_nothing_follows_a_call_that_does_not_return(self):
        code = """
            00000000 <f>:
            0: push {r4, lr}
            2: cbz r0, a <f+0xa>
            4: sub sp, #8
            6: bl 100 <stop>
            a: pop {r4, pc}
        """
        self.assertEqual(use(code + "\n00000100 <stop>:\n100: b.n 100 <stop>").bytes, 16)

    def test_code_that_runs_into_the_next_function(self):
        self.assertEqual(use("00000000 <f>:\n0: nop\n2: movs r0, #1\n00000100 <leaf>:\n100: push {r4, lr}\n102: pop {r4, pc}").bytes, 8)

    def test_recursion_is_an_error(self):
        code = """
            00000000 <f>:
            0: push {r4, lr}
            2: bl 100 <g>
            6: pop {r4, pc}
            00000100 <g>:
            100: push {r4, lr}
            102: bl 0 <f>
            106: pop {r4, pc}
        """
        with self.assertRaisesRegex(Unclear, "recursion: f > g > f"):
            use(code)

    def test_a_function_that_calls_itself_is_an_error(self):
        with self.assertRaisesRegex(Unclear, "recursion: f > f"):
            use("00000000 <f>:\n0: push {r4, lr}\n2: bl 0 <f>\n6: pop {r4, pc}")

    def test_calls_through_registers_are_listed_with_all_callers(self):
        code = """
            00000000 <f>:
            0: push {r4, lr}
            2: bl 100 <g>
            6: pop {r4, pc}
            00000100 <g>:
            100: push {r4, lr}
            102: blx r3
            104: pop {r4, lr}
            106: bx r2
        """
        self.assertEqual(use(code).indirect, {"g at 102: blx r3", "g at 106: bx r2"})


class Numbers(unittest.TestCase):
    def test_what_makes_something_is_a_row_of_its_own(self):
        rows = [stack.row_of(entry) for entry in ("gray.new_camera", "gray.push_frame", "trigger.new", "trigger.next", "trigger.newest")]
        self.assertEqual(rows, ["gray.new", "gray", "trigger.new", "trigger", "trigger"])
        rows = [stack.row_of(entry) for entry in ("gray.restart", "following.rezero_following", "any.set_trigger", "gray.set_floor", "gray.restarted")]
        self.assertEqual(rows, ["gray.restart", "following.restart", "any.restart", "gray", "gray"])

    def test_more_than_the_budget_no_budget_and_no_entry_point_are_problems(self):
        most = {"a": 100, "gone": 8}
        found = stack.problems({"a": {"M0": 104, "M3": 100}, "new": {"M0": 8}}, most)
        self.assertEqual(found, ["new: no budget, found {'M0': 8}", "gone: a budget, but no entry point", "a, M0: 104 bytes, at most 100"])
        self.assertEqual(stack.problems({"a": {"M0": 100}, "gone": {"M0": 0}}, most), [])

    def test_a_pattern_is_for_rows_without_a_budget_of_their_own(self):
        most = {"a.x": 10, "*.x": 20, "*.y": 30}
        found = stack.problems({"a.x": {"M0": 11}, "b.x": {"M0": 20}, "c.x": {"M0": 21}}, most)
        self.assertEqual(found, ["*.y: a budget, but no entry point", "a.x, M0: 11 bytes, at most 10", "c.x, M0: 21 bytes, at most 20"])

    def test_every_row_has_one_budget(self):
        most = stack.budgets()
        self.assertGreater(len(most), 50)
        self.assertEqual((most["gray"], most["gray.new"]), (1024, 3584))


if __name__ == "__main__":
    unittest.main()
