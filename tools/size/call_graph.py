"""Stack bounds from what gcc -fcallgraph-info=su writes: who calls whom, and each function's frame."""

import functools
import os
import re


class Broken(Exception):
    """A rule that is not kept; the first word names it."""


def plain(title):
    """A static function's title is PATH/FILE:NAME; two files may have one of the same name."""
    return os.path.basename(title)


def read(paths):
    """(stack bytes by function, callees by function) from .ci files."""
    stack, callees = {}, {}
    for path in paths:
        with open(path, encoding="utf-8") as file:
            text = file.read()
        for title, label in re.findall(r'node: \{ title: "([^"]*)" label: "([^"]*)"', text):
            size = re.search(r"(\d+) bytes \(([^)]*)\)", label)
            if not size:
                continue
            if size[2] not in ("static", "dynamic,bounded"):  # the latter's bytes are the bound
                raise Broken("calls: %s has a stack frame that is %s" % (title, size[2]))
            stack[plain(title)] = int(size[1])
            callees.setdefault(plain(title), set())
        for source, target in re.findall(r'edge: \{ sourcename: "([^"]*)" targetname: "([^"]*)"', text):
            if target == "__indirect_call":
                raise Broken("calls: %s calls through a pointer" % source)
            callees.setdefault(plain(source), set()).add(plain(target))
    return stack, callees


def deepest(stack, callees, entry, outside):
    """(bytes, chain) of the worst chain of calls from a function. outside: the stack that is charged for
    functions that are not the graph's own."""
    active = []

    @functools.lru_cache(maxsize=None)
    def below(function):
        if function in active:
            raise Broken("calls: recursion: " + " -> ".join(active[active.index(function):] + [function]))
        if function not in stack:
            if function not in outside:
                raise Broken("calls: %s is called and nowhere defined" % function)
            return outside[function], (function,)
        active.append(function)
        worst = max((below(callee) for callee in sorted(callees[function])), default=(0, ()))
        active.pop()
        return stack[function] + worst[0], (function,) + worst[1]

    return below(entry)


def check_all(stack, callees, outside):
    """No recursion anywhere, reachable or not."""
    for function in sorted(stack):
        deepest(stack, callees, function, outside)
