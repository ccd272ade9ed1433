"""TIM2 as a free-running 16-bit counter with two compare channels, which is embassy's clock."""

from .registers import Registers

TIM2, IRQ = 0x4000_0000, 28
CR1, DIER, SR, EGR, CNT, PSC, ARR, CCR1, CCR2 = 0x00, 0x0C, 0x10, 0x14, 0x24, 0x28, 0x2C, 0x34, 0x38
UPDATE, FIRST, SECOND = 1, 2, 4  # flags of SR and DIER
TURN = 1 << 16


class Timer(Registers):
    """Counts cycles of the machine, which equal those of the timer's clock."""

    IRQ = IRQ

    def __init__(self, machine):
        super().__init__(TIM2)
        self.machine, self.started, self.flags, self.plan = machine, None, 0, 0

    def reset(self):
        """Resets the timer: stopped at 0."""
        super().reset()
        self.started, self.flags = None, 0
        self.plan += 1

    def irqs(self):
        return {self.IRQ} if self.flags & self.values.get(DIER, 0) else set()

    def read(self, offset):
        if offset == CNT:
            return self._count() % TURN
        return self.flags if offset == SR else super().read(offset)

    def write(self, offset, value):
        """Stores a register, and plans the next event."""
        if offset == SR:
            self.flags &= value
            return
        super().write(offset, value)
        if offset == CR1:
            running = value & 1
            if running and self.started is None:
                self.started = self.machine.now
            elif not running:
                self.started = None
        if offset in (CR1, CCR1, CCR2, PSC):
            self._plan()

    def _step(self):
        return self.values.get(PSC, 0) + 1

    def _count(self):
        return 0 if self.started is None else (self.machine.now - self.started) // self._step()

    def _plan(self):
        self.plan += 1
        if self.started is None:
            return
        count = self._count()
        places = ((UPDATE, 0), (FIRST, self.values.get(CCR1, 0)), (SECOND, self.values.get(CCR2, 0)))
        # The distance of each, which is at least one count.
        distances = [((place - count - 1) % TURN + 1, flag) for flag, place in places]
        nearest = min(distances)[0]
        flags = sum(flag for distance, flag in distances if distance == nearest)
        plan = self.plan

        def reach():
            if plan == self.plan:
                self.flags |= flags
                self._plan()

        self.machine.at(self.started + (count + nearest) * self._step(), reach)
