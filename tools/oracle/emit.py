"""Write test vectors as C source that a test includes."""

import os

HEADER = ("/* {what}\n * Written by tools/oracle/make_vectors.py. Do not edit: change the script "
          "and run it again. */\n")
LINE = 100


class Inc:
    """One .inc file; the text is collected and written at the end."""

    def __init__(self, what):
        self.text = [HEADER.format(what=what)]

    def raw(self, text):
        self.text.append(text)

    def array(self, ctype, name, values, digits=None):
        """One flat array. digits: decimals of a floating-point array, None for integers."""
        self.text.append("\nstatic const %s %s[] = {\n%s};\n"
                         % (ctype, name, wrap(numbers(values, digits))))

    def struct_array(self, ctype, name, rows):
        """rows: the text of one initialiser each."""
        body = "".join("    {%s},\n" % row for row in rows)
        self.text.append("\nstatic const struct %s %s[] = {\n%s};\n" % (ctype, name, body))

    def write(self, directory, file_name):
        path = os.path.join(directory, file_name)
        with open(path, "w", encoding="ascii") as out:
            out.write("".join(self.text))
        return os.path.getsize(path)


def number(value, digits=None):
    if digits is None:
        if int(value) != value:
            raise ValueError("not an integer: %r" % value)
        return literal(int(value))
    text = "%.*f" % (digits, value)
    if float(text) == 0.0:
        return "0.0"
    return text.rstrip("0") + "0" if text.rstrip("0").endswith(".") else text.rstrip("0")


def literal(value):
    if -2**31 < value < 2**31:
        return str(value)
    if value == -2**31:
        return "(-2147483647 - 1)"
    return "INT64_C(%d)" % value


def numbers(values, digits=None):
    return [number(v, digits) for v in values]


def wrap(items, indent="    "):
    """Comma-separated items in lines of at most LINE characters."""
    lines, line = [], indent
    for item in items:
        if len(line) + len(item) + 2 > LINE and line != indent:
            lines.append(line.rstrip())
            line = indent
        line += item + ", "
    lines.append(line.rstrip())
    return "\n".join(lines) + "\n"
