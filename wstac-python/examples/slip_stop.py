"""Stops a machine when something slips over the sensor faster than a limit: python slip_stop.py SOURCE MM_S"""

import sys

import wstac


def stop() -> None:
    """Put the call that stops your machine here."""
    print("  stop")


def start() -> None:
    """Put the call that starts it again here."""
    print("  start")


limit = float(sys.argv[2])
stopped = False
for record in wstac.open(sys.argv[1], motion=True).records():
    # This comes with every frame while something slides. Two standard deviations make the decision safe.
    if isinstance(record, wstac.Motion):
        speed, direction = record.speed, record.direction
        if not stopped and speed.mm_s - 2 * (speed.sd or 0) > limit:
            print(f"frame {record.frame}: slip at {speed.mm_s:.0f} mm/s towards {direction.deg:.1f}°")
            stop()
            stopped = True
    # The light has left: nothing touches the sensor any more.
    elif isinstance(record, wstac.ContactEnd) and stopped:
        print(f"frame {record.frame}: released")
        start()
        stopped = False
    elif isinstance(record, wstac.Fault):
        print(f"frame {record.frame}: {record.message}", file=sys.stderr)
