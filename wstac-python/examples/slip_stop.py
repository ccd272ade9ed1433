"""Stops a machine when a part that is held begins to slip: python slip_stop.py SOURCE"""

import sys

import wstac


def stop() -> None:
    """Put the call that stops your machine here."""
    print("  stop")


for record in wstac.open(sys.argv[1]).records():
    # A part was pressed on and held, and moves now.
    if isinstance(record, wstac.Slip):
        ago = record.frame - record.onset_frame
        print(f"frame {record.frame}: slip since frame {record.onset_frame}, {ago} frames ago")
        stop()
    elif isinstance(record, wstac.Fault):
        print(f"frame {record.frame}: {record.message}", file=sys.stderr)
