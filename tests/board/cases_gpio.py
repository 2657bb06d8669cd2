"""Cases of the laser's line with either libgpiod, and of one that is active when low."""

from run import LASER, NAMES, SOON_S, expect, gated_loop
import cases_laser

FRAMES = 20
# Frames of a run with an active-low line.
LOW_FRAMES = 4


def case_gpiod(run):
    """libgpiod 2: the same records, in closed loop"""
    for gpiod in NAMES:
        with run.using(gpiod):
            run.start(run.gated, "gated")
            gated_loop(run, FRAMES)
            libraries = run.board.command("cat /proc/$program/maps; readlink /proc/$program/exe")
            expect(NAMES[gpiod] in libraries, f"another program: {libraries}")
            expect(("/libgpiod.so.2" in libraries) == (gpiod == 1),
                   f"what {NAMES[gpiod]} has loaded: {libraries}")
            run.stop()
    return f"{FRAMES} records identical to host_sim's with version 1 and with version 2"


def with_gpiod_2(case, *arguments):
    def again(run):
        with run.using(gpiod=2):
            return case(run, *arguments)
    again.__name__ = "case_" + case.__name__.removeprefix("case_") + "_gpiod2"
    again.__doc__ = f"libgpiod 2: {case.__doc__}" if case.__doc__ else "libgpiod 2: two signals"
    return again


def low_run(run):
    """Each way to end; how often the laser went on."""
    board = run.board
    on_count = 0
    for name in ["TERM", "SEGV", "KILL"]:
        edges = len(board.edges)
        run.start(run.gated, "gated")
        gated_loop(run, LOW_FRAMES)
        run.laser(1)
        run.low_after(f"kill -{name} $program")
        board.exit_status(SOON_S)
        board.command("while pidof isohead-guard; do sleep 0.01; done >/dev/null")
        moves = [edge.level for edge in board.edges[edges:] if edge.line == LASER]
        # On for each frame and the one that does not come, in turn with off: not once more.
        wanted = [0, 1] * (LOW_FRAMES + 1)
        expect(moves == wanted, f"levels until after SIG{name}: {moves}, expected {wanted}")
        on_count += moves.count(0)
    return on_count


def case_active_low(run):
    """a laser that low switches on: the pin from before opening until after SIGKILL"""
    on_count = 0
    for gpiod in NAMES:
        with run.using(gpiod, active_low=True):
            edges = len(run.board.edges)
            run.laser_off()
            run.laser_off()
            moves = [edge.level for edge in run.board.edges[edges:] if edge.line == LASER]
            expect(moves == [1], f"levels of two --laser-off: {moves}, expected 1 once")
            on_count += low_run(run)
        run.laser_off()
    return (f"low {on_count} times, for frames only; not at open, at close, after SIGTERM, SIGSEGV, "
            "SIGKILL, with either libgpiod")


CASES = [case_gpiod, with_gpiod_2(cases_laser.case_interlock), with_gpiod_2(cases_laser.case_killed),
         with_gpiod_2(cases_laser.case_all_killed),
         with_gpiod_2(cases_laser.signals, ["TERM", "SEGV"]), case_active_low]
