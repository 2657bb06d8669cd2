#!/usr/bin/env python3
"""What make size stands on, on made-up input: limits.conf, stacks out of call graphs and assembly, bounds."""

import contextlib
import io
import os
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "size"))
import call_graph
import limits
import program
import size


class Limits(unittest.TestCase):
    def read(self, text):
        with tempfile.NamedTemporaryFile("w", suffix=".conf", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            return limits.read(file.name)

    def whole(self, **other):
        bounds = {name: "100" for name in limits.NAMES} | other
        return "".join("%s = %s\n" % pair for pair in bounds.items() if pair[1])

    def test_the_projects_own(self):
        bounds = limits.read()
        self.assertEqual(set(bounds), limits.NAMES)
        self.assertEqual(bounds["ram_bytes"], 192 * 1024)
        self.assertEqual(bounds["flash_bytes"], 112 * 1024)
        self.assertEqual(bounds["stack_bytes"], 4 * 1024)

    def test_comments_and_blanks(self):
        text = "# a comment = 5\n\n  \n" + self.whole(ram_bytes="7  # and = more")
        self.assertEqual(self.read(text)["ram_bytes"], 7)

    def test_wrong_lines(self):
        for line in ("ram_bytes 5", "ram_bytes = ", "ram_bytes = 5 kB", "ram_bytes = -5", "ram_bytes = 0x5",
                     "ram_bytes = 5\nram_bytes = 5", "ram = 5", "= 5"):
            with self.assertRaises(limits.Wrong, msg=line):
                self.read(self.whole().replace("ram_bytes = 100", line))

    def test_missing(self):
        with self.assertRaisesRegex(limits.Wrong, "missing: stack_bytes"):
            self.read(self.whole(stack_bytes=""))


class CallGraph(unittest.TestCase):
    def graph(self, *lines):
        with tempfile.NamedTemporaryFile("w", suffix=".ci", encoding="utf-8") as file:
            file.write("graph: {\n%s\n}\n" % "\n".join(lines))
            file.flush()
            return call_graph.read([file.name])

    @staticmethod
    def node(name, stack):
        return 'node: { title: "%s" label: "%s\\nx.c:1:2\\n%s" }' % (name, name, stack)

    @staticmethod
    def edge(source, target):
        return 'edge: { sourcename: "%s" targetname: "%s" }' % (source, target)

    def test_the_deepest_is_not_the_longest(self):
        stack, callees = self.graph(
            self.node("a", "8 bytes (static)"), self.node("/p/x.c:b", "16 bytes (static)"),
            self.node("c", "100 bytes (dynamic,bounded)"), self.edge("a", "/p/x.c:b"), self.edge("a", "c"),
            self.edge("/p/x.c:b", "memcpy"))
        self.assertEqual(call_graph.deepest(stack, callees, "a", {"memcpy": 20}), (108, ("a", "c")))
        self.assertEqual(call_graph.deepest(stack, callees, "a", {"memcpy": 90}), (114, ("a", "x.c:b", "memcpy")))

    def test_broken(self):
        a = self.node("a", "8 bytes (static)")
        for lines, word in (((a, self.edge("a", "a")), "recursion"), ((a, self.edge("a", "puts")), "nowhere"),
                            ((a, self.edge("a", "__indirect_call")), "pointer"),
                            ((self.node("a", "8 bytes (dynamic)"),), "dynamic")):
            with self.assertRaisesRegex(call_graph.Broken, word):
                stack, callees = self.graph(*lines)
                call_graph.check_all(stack, callees, {})


class Assembly(unittest.TestCase):
    def test_what_lowers_the_stack_pointer(self):
        for name, operands, wanted in (
                ("push", "{r4, r5, lr}", 12), ("stmdb", "sp!, {r4, r5, r6, lr}", 16),
                ("str.w", "lr, [sp, #-4]!", 4), ("strd", "ip, lr, [sp, #-16]!", 16), ("sub", "sp, #24", 24),
                ("sub.w", "sp, sp, #560", 560), ("subw", "sp, sp, #1044", 1044), ("str", "r0, [sp, #4]", 0),
                ("sub.w", "ip, sp, #8", 0), ("add", "sp, #16", 0), ("pop", "{r4, pc}", 0),
                ("ldmia.w", "sp!, {r4, pc}", 0), ("stmdb", "r1!, {r4, r5}", 0), ("mov", "r0, sp", 0)):
            self.assertEqual(program.pushed(name, operands), wanted, (name, operands))

    def test_what_cannot_be_determined(self):
        for name, operands in (("mov", "sp, r7"), ("sub.w", "sp, sp, r3"), ("bic", "sp, r3, #7")):
            with self.assertRaises(call_graph.Broken, msg=(name, operands)):
                program.pushed(name, operands)

    @staticmethod
    def made_up(**code):
        made = program.Program.__new__(program.Program)
        made.code = code
        made.name = {16 * (i + 1): name for i, name in enumerate(code)}
        return made

    def test_stack_of_functions_that_call(self):
        made = self.made_up(a=[("push", "{r4, lr}"), ("bl", "20 <b>"), ("b.w", "30 <c>"), ("bne.n", "10 <a>")],
                            b=[("sub", "sp, #8"), ("bx", "lr")], c=[("sub", "sp, #12"), ("beq.n", "34 <c+0x4>")])
        self.assertEqual(made.stack_of("a"), 20)

    def test_first_store(self):
        made = self.made_up(a=[("cmp", "r1, #11"), ("push", "{r4, lr}"), ("sub", "sp, #8")],
                            b=[("str", "r0, [sp, #4]"), ("push", "{r4, lr}")])
        self.assertEqual(made.first_push("a"), 8)
        with self.assertRaises(call_graph.Broken):
            made.first_push("b")

    def test_recursion_and_registers(self):
        made = self.made_up(a=[("bl", "20 <b>")], b=[("b.n", "10 <a>")], c=[("blx", "r3")], d=[("mov", "pc, r3")])
        for function in "acd":
            with self.assertRaises(call_graph.Broken, msg=function):
                made.stack_of(function)


class Bounds(unittest.TestCase):
    def test_one_more_is_too_much(self):
        bounds = limits.read()
        with contextlib.redirect_stdout(io.StringIO()) as out:
            self.assertEqual(size.judge(dict(bounds)), 0)
            self.assertNotIn("PASSED", out.getvalue())
            for name in bounds:
                self.assertEqual(size.judge(bounds | {name: bounds[name] + 1}), 1)
        self.assertEqual(out.getvalue().count("PASSED"), len(bounds))


if __name__ == "__main__":
    unittest.main()
