"""The places of a C source where tests/checks/mutation.py makes a mistake on purpose.

A mutant is the source with one text replaced. Those that do not compile (a * that declares a
pointer) are the caller's to drop: telling them apart would need a parser of C.
"""

import collections
import re

# kind, place in the text, and what stands there instead
Mutant = collections.namedtuple("Mutant", "kind start end new")

TOKEN = re.compile(r"""
    (?P<comment>/\*.*?\*/|//[^\n]*)
  | (?P<directive>^[ \t]*\#(?:\\\n|/\*.*?\*/|[^\n])*)
  | (?P<text>"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*')
  | (?P<number>\b(?:0[xX][0-9a-fA-F]+|\d+)[uUlL]*)
  | (?P<word>[A-Za-z_]\w*)
  | (?P<sign><<=|>>=|\+\+|--|->|<<|>>|<=|>=|==|!=|&&|\|\||[-+*/%&|^]=|[-+*/%&|^!~<>=?:;,.(){}\[\]])
""", re.VERBOSE | re.DOTALL | re.MULTILINE)
DEFINE = re.compile(r"[ \t]*#[ \t]*define[ \t]+\w+[ \t]+(?P<value>.*)", re.DOTALL)

SWAPS = {
    "arithmetic": {"+": "-", "-": "+", "*": "/", "/": "*", "%": "*", "+=": "-=", "-=": "+=",
                   "*=": "/=", "/=": "*=", "++": "--", "--": "++", "|": "&", "&": "|", "|=": "&=",
                   "&=": "|="},
    "comparison": {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "=="},
    "logic": {"&&": "||", "||": "&&"},
    "shift": {"<<": ">>", ">>": "<<", "<<=": ">>=", ">>=": "<<="},
}
KINDS = list(SWAPS) + ["constant", "condition", "statement"]
# Words that no statement to be left out begins with.
NOT_A_STATEMENT = {"return", "if", "for", "while", "do", "switch", "case", "default", "else", "goto",
                   "const", "static", "struct", "enum", "union", "typedef", "_Static_assert"}

Token = collections.namedtuple("Token", "kind text start end")


def tokens(text):
    found = []
    for match in TOKEN.finditer(text):
        kind = match.lastgroup
        if kind == "directive":
            define = DEFINE.match(match[0])
            if define:  # its constants are the core's
                at = match.start() + define.start("value")
                found += [Token(t.kind, t.text, t.start + at, t.end + at)
                          for t in tokens(define["value"]) if t.kind != "comment"]
            found.append(Token("directive", "", match.end(), match.end()))
        elif kind != "comment":
            found.append(Token(kind, match[0], match.start(), match.end()))
    return found


def closing(found, at):
    """Index of the parenthesis that closes the one at an index."""
    depth = 0
    for i in range(at, len(found)):
        depth += {"(": 1, ")": -1}.get(found[i].text, 0)
        if depth == 0:
            return i
    raise ValueError("no closing parenthesis")


def without_assertions(found):
    """A _Static_assert that fails is found by the compiler, not by a test."""
    kept, i = [], 0
    while i < len(found):
        if found[i].text == "_Static_assert":
            i = closing(found, i + 1)
        else:
            kept.append(found[i])
        i += 1
    return kept


def is_array_size(found, i):
    """Is this number all there is between the brackets of a declaration?"""
    if not (2 < i < len(found) - 1 and found[i - 1].text == "[" and found[i + 1].text == "]"):
        return False
    name = i - 2
    while found[name].text == "]":  # of an array of arrays
        while found[name].text != "[":
            name -= 1
        name -= 1
    before = found[name - 1]
    return before.kind == "word" and before.text != "return" or before.text in ("*", ",")


def constants(found):
    for i, token in enumerate(found):
        if token.kind == "number" and not is_array_size(found, i):
            suffix = token.text.lstrip("0123456789abcdefABCDEFxX")
            value = int(token.text[:len(token.text) - len(suffix)], 0)
            for new in (value + 1, value - 1):
                if new >= 0:
                    yield Mutant("constant", token.start, token.end, "%d%s" % (new, suffix))


def is_type(found, i):
    """Does a * after this word declare a pointer?"""
    return found[i].text.endswith("_t") or found[i].text in ("void", "char", "int", "const") or \
        found[i - 1].text in ("struct", "enum", "union")


def operators(found):
    """Not an operator of one operand: there is a number, a name or a closing bracket before."""
    for i, token in enumerate(found):
        for kind, swaps in SWAPS.items():
            if token.text not in swaps or token.kind != "sign":
                continue
            before = found[i - 1]
            if token.text in ("+", "-", "*", "&") and \
                    not (before.kind in ("number", "word") or before.text in (")", "]")):
                continue
            if before.text == "return" or token.text == "*" and is_type(found, i - 1):
                continue
            yield Mutant(kind, token.start, token.end, swaps[token.text])


def conditions(found, text):
    for i, token in enumerate(found[:-1]):
        if token.text in ("if", "while") and found[i + 1].text == "(":
            first, last = found[i + 1], found[closing(found, i + 1)]
            inner = text[first.end:last.start]
            yield Mutant("condition", first.end, last.start, "!(%s)" % inner)


def statements(found):
    """Assignments, calls, break and continue, each to its semicolon."""
    depth, begin, headers, choices = 0, None, [], 0
    for i, token in enumerate(found):
        if token.text in ("(", "["):
            headers.append(token.text == "(" and found[i - 1].text in ("if", "for", "while", "switch"))
            depth += 1
        elif token.text in (")", "]"):
            depth -= 1
            if headers.pop() and depth == 0:
                begin = i + 1
                continue
        if depth > 0:
            continue
        if token.text == ";" and begin is not None and begin < i:
            first, second = found[begin], found[begin + 1]
            declaration = second.kind == "word" and first.kind == "word"
            if first.text not in NOT_A_STATEMENT and not declaration:
                yield Mutant("statement", first.start, token.start, "")
        choices += token.text == "?"
        if token.text == ":" and choices > 0:
            choices -= 1
        elif token.text in (";", "{", "}", ":", "else", "do") or token.kind == "directive":
            begin = i + 1


def mutants(text):
    """All of a source's, in its order."""
    found = without_assertions(tokens(text))
    every = list(operators(found)) + list(constants(found)) + list(conditions(found, text)) + \
        list(statements(found))
    return sorted(set(every), key=lambda mutant: (mutant.start, mutant.end, mutant.new))


def apply(text, mutant):
    return text[:mutant.start] + mutant.new + text[mutant.end:]


def line_of(text, mutant):
    return text.count("\n", 0, mutant.start) + 1


def describe(text, mutant):
    """`what stood there -> what stands there now` in its line."""
    old = " ".join(text[mutant.start:mutant.end].split())
    new = {"statement": "(nothing)", "condition": "!(...)"}.get(mutant.kind, mutant.new)
    line = text.splitlines()[line_of(text, mutant) - 1].strip()
    return "%s: %s -> %s   in: %s" % (mutant.kind, old if len(old) < 40 else old[:36] + " ...", new, line)
