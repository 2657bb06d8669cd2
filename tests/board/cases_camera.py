"""Cases of a camera's settings, on the kernel's virtual camera (vivid), which has a gain and rates."""

from run import INTERLOCK, LASER, SOON_S, expect

DEVICE = "/dev/video1"
RATE = 10
GAIN, AUTOMATIC = "Gain", "Gain, Automatic"


def plug_in(run):
    board = run.board
    board.command(f"[ -e {DEVICE} ] || modprobe vivid n_devs=1 num_inputs=1 input_types=0 "
                  "node_types=1 vid_cap_nr=1")
    board.set_input(INTERLOCK, 1)
    board.records.clear()
    board.log.clear()


def control(run, name):
    return int(run.board.command(f"control {DEVICE} '{name}'"))


def accepted(run, options):
    """It gives frames with these settings."""
    plug_in(run)
    run.start_at(DEVICE, "small", "always", f"--format GREY --rate {RATE} {options}")
    run.laser(1)
    run.board.records.clear()
    run.board.record(SOON_S)


def refused(run, options, text):
    """It says why, tries again, and the laser stays off."""
    plug_in(run)
    board, rises = run.board, run.board.rises[LASER]
    run.start_at(DEVICE, "small", "always", f"--format GREY --rate {RATE} {options}")
    reported = f"{DEVICE}: {text}; trying again"
    board.wait(lambda: sum(reported in line for line in board.log) >= 2, SOON_S,
               f"second '{reported}' for {options}")
    expect(board.rises[LASER] == rises, f"the laser went on with {options}")
    expect(not board.records, f"a record with {options}")
    run.stop()


def case_gain(run):
    """gain and exposure: set, read back, refused"""
    plug_in(run)
    run.board.command(f"control {DEVICE} '{GAIN}' 11; control {DEVICE} '{AUTOMATIC}' 1")
    accepted(run, "--gain 37")
    found = control(run, GAIN), control(run, AUTOMATIC)
    expect(found == (37, 0), f"gain and automatic gain after --gain 37: {found}")
    run.stop()
    accepted(run, "--gain keep")
    found = control(run, GAIN), control(run, AUTOMATIC)
    expect(found == (37, 0), f"gain and automatic gain after --gain keep: {found}")
    run.stop()
    accepted(run, "--gain auto")
    expect(control(run, AUTOMATIC) == 1, "automatic gain is off after --gain auto")
    run.stop()
    refused(run, "--gain 256", "gain 256: Gain would be 256, expected 0..255")
    refused(run, "--exposure 5000", "exposure 5000 us: the device has no control of exposure")
    refused(run, "--exposure auto", "exposure auto: the device has no automatic exposure")
    accepted(run, "--exposure steer")
    reported = [line for line in run.board.log if "it stays as it is" in line]
    expect(len(reported) == 1 and "no control of exposure" in reported[0], f"steering: {run.board.log}")
    run.stop()
    return "gain 37 is read back, 256 and an exposure refused with message and retry, laser off"


def case_rate(run):
    """a frame rate that the camera does not have"""
    accepted(run, "--rate 25")
    expect(any("a frame every 40000 us" in line for line in run.board.log), f"{run.board.log}")
    run.stop()
    refused(run, "--rate 27", "requested 27.000 frames a second, the device gives 25.000; it has: "
            "1.000, 2.000, 4.000, 5.000, 10.000, 12.500, 15.000, 25.000")
    return "25 is taken, 27 refused: the message lists the camera's rates"


CASES = [case_gain, case_rate]
