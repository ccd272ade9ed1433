"""Tests the stack analysis on small pieces of disassembly. The expected bytes are counted by hand."""

import unittest

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
# The function g goes on.
CALL = """
    00000000 <f>:
    0: push {r4, lr}
    2: bl 100 <g>
    6: pop {r4, pc}
    00000100 <g>:
    100: push {r4, lr}
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

    def test_an_unknown_change_is_an_error(self):
        for code in ("mov sp, r4", "add sp, r6", "bic.w sp, sp, #7", "ldr sp, [r0]", "sub.w sp, sp, r4", "msr MSP, r0", "ldm sp!, {r4}", "ldmia.w sp, {r4, sp}", "sub.w sp, r4, #8"):
            with self.subTest(code), self.assertRaisesRegex(Unclear, code.split()[-1]):
                use(f"00000000 <f>:\n0: {code}\n4: bx lr")


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

    def test_recursion_is_an_error(self):
        with self.assertRaisesRegex(Unclear, "recursion: f > g > f"):
            use(CALL + "102: bl 0 <f>\n106: pop {r4, pc}")

    def test_calls_through_registers_are_listed_with_all_callers(self):
        code = CALL + "102: blx r3\n104: pop {r4, lr}\n106: bx r2"
        self.assertEqual(use(code).indirect, {"g at 102: blx r3", "g at 106: bx r2"})


if __name__ == "__main__":
    unittest.main()
