"""A browser without a window, driven through pipes by the Chrome DevTools protocol: Python's standard
library and Debian's chromium are all that it needs.

    with Browser(work) as browser:
        browser.open("/folder/page.html")
        browser.value("document.title")

Everything that the page logs as an error, throws, or asks the network for is kept in `errors` and `requests`.
"""

import base64
import json
import os
import select
import shutil
import subprocess
import time

TIMEOUT_S = 60  # of one call; on a busy machine the first frame of software 3-D takes seconds

# What chromium answers to a question about a page that a link is just leading away from.
LEFT_PAGE = ("Inspected target navigated or closed", "Execution context was destroyed.", "Cannot find default execution context")


class LeftPage(RuntimeError):
    pass


class Browser:
    def __init__(self, work):
        program = shutil.which("chromium") or shutil.which("chromium-browser")
        if program is None:
            raise SystemExit("no chromium here: install the package chromium")
        profile = os.path.join(work, "profile")
        to_browser, self.write_end = os.pipe()
        self.read_end, from_browser = os.pipe()

        def connect():  # the protocol's ends are 3 and 4
            low = [os.dup(to_browser), os.dup(from_browser)]
            copies = [os.dup(d) if d in (3, 4) else d for d in low]
            os.dup2(copies[0], 3)
            os.dup2(copies[1], 4)

        command = [program, "--headless=new", "--remote-debugging-pipe", "--user-data-dir=" + profile,
                   "--no-first-run", "--disable-extensions", "--disable-background-networking",
                   "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage",
                   "--hide-scrollbars", "--force-color-profile=srgb",
                   # 3-D without a graphics card
                   "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
        if os.geteuid() == 0:
            command.append("--no-sandbox")  # chromium's own does not start for root
        self.log = open(os.path.join(work, "chromium.log"), "w", encoding="utf-8")
        self.process = subprocess.Popen(command + ["about:blank"], preexec_fn=connect, close_fds=False,
                                        stdin=subprocess.DEVNULL, stdout=self.log, stderr=self.log)
        os.close(to_browser)
        os.close(from_browser)
        self.buffer = b""
        self.number = 0
        self.answers = {}
        self.session = None
        self.errors, self.requests = [], []
        self.loaded = False
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network", "Accessibility"):
            self.call(domain + ".enable")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.log.close()

    # --- the protocol ----------------------------------------------------------------------------

    def take(self, message):
        if "id" in message:
            self.answers[message["id"]] = message
            return
        method, params = message["method"], message["params"]
        if method == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.errors.append(" ".join(str(a.get("value", a.get("description"))) for a in params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] == "error":
            self.errors.append(params["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(params["request"]["url"])
        elif method == "Page.loadEventFired":
            self.loaded = True

    def receive(self, deadline):
        if not select.select([self.read_end], [], [], max(0, deadline - time.monotonic()))[0]:
            raise TimeoutError("chromium does not answer")
        data = os.read(self.read_end, 1 << 20)
        if not data:
            raise EOFError("chromium is gone: see " + self.log.name)
        *messages, self.buffer = (self.buffer + data).split(b"\0")
        for message in messages:
            self.take(json.loads(message))

    def call(self, method, **params):
        self.number += 1
        message = {"id": self.number, "method": method, "params": params}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.write_end, json.dumps(message).encode() + b"\0")
        deadline = time.monotonic() + TIMEOUT_S
        while self.number not in self.answers:
            self.receive(deadline)
        answer = self.answers.pop(self.number)
        if "error" in answer:
            message = answer["error"]["message"]
            raise (LeftPage if message in LEFT_PAGE else RuntimeError)("%s: %s" % (method, message))
        return answer["result"]

    # --- what a user does ------------------------------------------------------------------------

    def open(self, path):
        """A file's path, or http://..."""
        self.loaded = False
        self.call("Page.navigate", url=path if path.startswith("http://") else "file://" + path)
        deadline = time.monotonic() + TIMEOUT_S
        while not self.loaded:
            self.receive(deadline)

    def value(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError("%s: %s" % (expression, result["exceptionDetails"]["exception"]["description"]))
        return result["result"].get("value")

    def is_true(self, expression):
        """Not of a page that is just being left."""
        try:
            return self.value(expression)
        except LeftPage:
            return False

    def until(self, expression):
        """Wait until an expression is true, of this page or of the one that it leads to."""
        deadline = time.monotonic() + TIMEOUT_S
        while not self.is_true(expression):
            if time.monotonic() > deadline:
                raise TimeoutError("never true: " + expression)
            time.sleep(0.02)

    def size(self, width, height, scale=1, phone=False):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=phone)

    def media(self, kind="", **features):
        self.call("Emulation.setEmulatedMedia", media=kind,
                  features=[{"name": n.replace("_", "-"), "value": v} for n, v in features.items()])

    KEYS = {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, "PageUp": 33, "PageDown": 34, "End": 35,
            "Home": 36, "Tab": 9, "Enter": 13}

    def key(self, key):
        code = self.KEYS.get(key, ord(key.upper()) if len(key) == 1 else 0)
        text = {"text": key} if len(key) == 1 else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, windowsVirtualKeyCode=code, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key, windowsVirtualKeyCode=code)

    def position(self, selector):
        """The middle of an element, which is scrolled to."""
        return self.value("(() => { const e = document.querySelector(%s); e.scrollIntoView({block: 'center', behavior: 'instant'});"
                          " const r = e.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; })()"
                          % json.dumps(selector))

    def mouse(self, kind, x, y, buttons=0):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=buttons, clickCount=1)

    def drag(self, selector, dx, dy):
        x, y = self.position(selector)
        self.mouse("mousePressed", x, y, 1)
        for step in range(1, 9):
            self.mouse("mouseMoved", x + dx * step / 8, y + dy * step / 8, 1)
        self.mouse("mouseReleased", x + dx, y + dy)

    def click(self, selector):
        self.drag(selector, 0, 0)

    def screenshot(self, path, selector=None, whole=False):
        params = {"captureBeyondViewport": True} if whole or selector else {}
        if selector:
            self.position(selector)
            params["clip"] = self.value(
                "(() => { const r = document.querySelector(%s).getBoundingClientRect();"
                " return {x: r.x + scrollX, y: r.y + scrollY, width: r.width, height: r.height, scale: 1}; })()" % json.dumps(selector))
        elif whole:
            width, height = self.value("[innerWidth, document.documentElement.scrollHeight]")
            params["clip"] = {"x": 0, "y": 0, "width": width, "height": height, "scale": 1}
        with open(path, "wb") as file:
            file.write(base64.b64decode(self.call("Page.captureScreenshot", format="png", **params)["data"]))

    def tree(self):
        """What a screen reader reads: (role, name) of every node that is not ignored."""
        nodes = self.call("Accessibility.getFullAXTree")["nodes"]
        return [(n["role"]["value"], n.get("name", {}).get("value", "")) for n in nodes if not n["ignored"]]
