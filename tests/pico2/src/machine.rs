//! A Raspberry Pi Pico 2 in rp2350-emu, with an HM01B0 at its pins and a host at its serial line.
//!
//! The emulator has the core, the interrupts, clocks, timer, resets, pins and the PIO. Modeled here, from the data
//! sheet of the RP2350, is what it does not have, or has in another way or without the outside world:
//!
//! - I2C0 (chapter 12.2), whose emulated one has no sensors;
//! - UART0 (12.1), whose emulated one sends to nobody;
//! - the clock output (8.1), which it does not keep;
//! - the DMA, in `dma.rs`;
//! - WAIT IRQ of the PIO (11.4.3), which in the emulator waits for ever once it waits;
//! - the watchdog (12.9), whose emulated one does not count microseconds;
//! - the generator of the timer's microseconds (8.5), which takes the system's clock for that of the crystal;
//! - loads that acquire, stores that release, and VPUSH, VPOP, VMOV, VLDR and VSTR of pairs of registers, which its
//!   core does not know; CPS, of which it takes one mask for the other; VSEL, VMAXNM and VMINNM, of which it takes a
//!   bit of the register for another.
//!
//! The boot ROM is not run. Its work is done here: the block of the image is looked for and must be right (5.9), then
//! the core begins with the vector table at the beginning of the image. Its functions for the flash are in `flash.rs`.
//! Not modeled: electricity, and the time of instructions in flash and of a byte that the board sends.

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use rp2350_emu::core::bus_trait::CoreBus;
use rp2350_emu::threaded::CoreAtomics;
use rp2350_emu::{Bus, Config, CortexM33, Emulator, EmulatorBuilder};

use crate::dma::{self, Dma};
use crate::flash::{self, BOOT_RAM, Flash, QMI};
use crate::sensor::Hm01b0;

/// The wires of wstac-fw/README.md.
const DATA: u32 = 6;
const PCLK: u32 = 14;
const HREF: u32 = 15;
const VSYNC: u32 = 16;
const CLOCK_PIN: u32 = 21;
const SDA: u32 = 4;
const SCL: u32 = 5;
const EVENTS: u32 = 25;
const TROUBLE: u32 = 22;

const FLASH: u32 = 0x1000_0000;
const RAM: u32 = 0x2000_0000;
const RAM_SIZE: u32 = 520 * 1024;
const I2C0: u32 = 0x4009_0000;
const UART0: u32 = 0x4007_0000;
const WATCHDOG: u32 = 0x400D_8000;
const CLOCKS: u32 = 0x4001_0000;
/// The cycles of a microsecond: a register of the generator of ticks, and the number of cycles that is right for it.
const TIMER_CYCLES: u32 = 0x4010_801C;
const CRYSTAL_MEGAHERTZ: u32 = 12;
const IO_BANK0: u32 = 0x4002_8000;
const PADS_BANK0: u32 = 0x4003_8000;
const UART0_INTERRUPT: u32 = 33;
/// The clock that the program must set, and the cycles of the core while no pixels come.
const HERTZ: u64 = 120_000_000;
const IDLE: u32 = 600;
const FRAME: u64 = HERTZ / 30;
/// The cycles of a byte on the serial line to the board: 10 bits.
const BYTE: u64 = HERTZ * 10 / 115_200;

/// The parts that the emulator lacks.
struct Outside {
    sensor: Hm01b0,
    sent: Vec<u8>,
    received: VecDeque<u8>,
    /// Bytes from the host, and when the next one comes.
    incoming: VecDeque<u8>,
    next_byte: u64,
    i2c: HashMap<u32, u32>,
    i2c_read: VecDeque<u8>,
    i2c_busy: bool,
    /// The cycles of a byte on the bus; what waits for it, and until when.
    bus_byte: u64,
    commands: VecDeque<(u32, u64)>,
    uart: HashMap<u32, u32>,
    clock_output: HashMap<u32, u32>,
    dma: Dma,
    dog: HashMap<u32, u32>,
    now: u64,
    /// When the watchdog ends, if it counts, and the reason of a reset that it wants.
    ends: Option<u64>,
    wants_reset: Option<u32>,
    has_sensor_clock: bool,
    /// Whether the memory interface was set up since that was looked at.
    has_set_up: bool,
}

/// Returns the new value of a register after a write to it or to one of its aliases (2.1.3).
fn written(old: u32, address: u32, value: u32) -> u32 {
    match address >> 12 & 3 {
        0 => value,
        1 => old ^ value,
        2 => old | value,
        _ => old & !value,
    }
}

impl Outside {
    /// Returns the peripheral that is modeled here, and the offset of the register.
    fn place(address: u32) -> Option<(u32, u32)> {
        let (base, offset) = (address & !0x3FFF, address & 0xFFF);
        let is_here =
            matches!(base, I2C0 | UART0 | WATCHDOG | dma::BASE | BOOT_RAM | QMI) || base == CLOCKS && offset <= 4;
        is_here.then_some((base, offset))
    }

    fn read(&mut self, base: u32, offset: u32) -> u32 {
        while let Some((command, _)) = self.commands.pop_front_if(|(_, end)| *end <= self.now) {
            self.transfer(command);
        }
        let (is_idle, waiting) = (self.commands.is_empty(), self.commands.len() as u32);
        match (base, offset) {
            // IC_DATA_CMD, IC_RAW_INTR_STAT, IC_CLR_TX_ABRT, IC_CLR_STOP_DET, IC_STATUS, IC_RXFLR, IC_ENABLE_STATUS.
            (I2C0, 0x10) => self.i2c_read.pop_front().unwrap_or(0).into(),
            (I2C0, 0x34) => u32::from(is_idle) << 4 | self.i2c.get(&0x34).copied().unwrap_or(0),
            (I2C0, 0x54) => {
                *self.i2c.entry(0x34).or_default() &= !(1 << 6);
                self.i2c.insert(0x80, 0);
                0
            }
            (I2C0, 0x60) => {
                *self.i2c.entry(0x34).or_default() &= !(1 << 9);
                0
            }
            (I2C0, 0x70) => {
                u32::from(waiting < 16) << 1 | u32::from(is_idle) << 2 | u32::from(!self.i2c_read.is_empty()) << 3
            }
            (I2C0, 0x74) => waiting,
            (QMI, _) => 0,
            (I2C0, 0x78) => self.i2c_read.len() as u32,
            (I2C0, 0x9C) => self.i2c.get(&0x6C).copied().unwrap_or(0) & 1,
            (I2C0, _) => self.i2c.get(&offset).copied().unwrap_or(0),
            // UARTDR; UARTFR: the transmitter is empty; UARTRIS, UARTMIS.
            (UART0, 0x00) => self.received.pop_front().unwrap_or(0).into(),
            (UART0, 0x18) => 1 << 7 | u32::from(self.received.is_empty()) << 4,
            (UART0, 0x3C) => self.raised(),
            (UART0, 0x40) => self.raised() & self.uart.get(&0x38).copied().unwrap_or(0),
            (UART0, _) => self.uart.get(&offset).copied().unwrap_or(0),
            (CLOCKS, _) => self.clock_output.get(&offset).copied().unwrap_or(0),
            (dma::BASE, _) => self.dma.read(offset),
            (BOOT_RAM, _) => flash::boot_ram(offset),
            _ => self.dog.get(&offset).copied().unwrap_or(0),
        }
    }

    fn write(&mut self, address: u32, base: u32, offset: u32, value: u32) {
        match (base, offset) {
            (I2C0, 0x10) => self.queue(value),
            (dma::BASE, _) => self.dma.write(offset, written(self.dma.read(offset), address, value)),
            (UART0, 0x00) => self.sent.push(value as u8),
            (BOOT_RAM, _) => {}
            (QMI, _) => self.has_set_up = true,
            // CTRL: a trigger resets at once.
            // What it resets is chosen by PSM.WDSEL, which `advance` looks at.
            (WATCHDOG, 0x00) => {
                let old = self.dog.get(&0).copied().unwrap_or(0);
                let new = written(old, address, value);
                if new & 1 << 31 != 0 {
                    self.wants_reset = Some(0b10);
                }
                self.dog.insert(0, new & !(1 << 31));
                self.count();
            }
            (WATCHDOG, 0x04) => {
                self.dog.insert(4, value & 0xFF_FFFF);
                self.count();
            }
            _ => {
                let registers = match base {
                    I2C0 => &mut self.i2c,
                    UART0 => &mut self.uart,
                    CLOCKS => &mut self.clock_output,
                    _ => &mut self.dog,
                };
                let register = registers.entry(offset).or_default();
                *register = written(*register, address, value);
            }
        }
    }

    /// Begins the watchdog's time anew: microseconds, in contrast to the RP2040.
    fn count(&mut self) {
        let [control, load] = [0, 4].map(|offset| self.dog.get(&offset).copied().unwrap_or(0));
        self.ends = (control & 1 << 30 != 0).then_some(self.now + u64::from(load) * (HERTZ / 1_000_000));
    }

    /// Returns whether the line is on, and receives (UARTCR).
    fn listens(&self) -> bool {
        self.uart.get(&0x30).is_some_and(|control| control & 0x201 == 0x201)
    }

    /// Returns the raw interrupts of the line: something was received.
    fn raised(&self) -> u32 {
        if self.received.is_empty() { 0 } else { 1 << 4 | 1 << 6 }
    }

    /// Queues a byte on the sensor's bus. A first one, and one behind a restart, has the address in front.
    fn queue(&mut self, command: u32) {
        if self.bus_byte == 0 {
            return self.transfer(command);
        }
        let is_first = self.commands.is_empty() && !self.i2c_busy || command & 1 << 10 != 0;
        let begins = self.commands.back().map_or(self.now, |&(_, end)| end.max(self.now));
        self.commands.push_back((command, begins + self.bus_byte * if is_first { 2 } else { 1 }));
    }

    /// Sends or receives a byte on the sensor's bus.
    fn transfer(&mut self, command: u32) {
        if !self.i2c_busy || command & 1 << 10 != 0 {
            self.sensor.start();
            self.i2c_busy = true;
        }
        let address = self.i2c.get(&0x04).copied().unwrap_or(0) as u8;
        if !(self.has_sensor_clock && self.sensor.answers(address)) {
            // Nobody acknowledges: an abort, and a stop.
            *self.i2c.entry(0x34).or_default() |= 1 << 6 | 1 << 9;
            self.i2c.insert(0x80, 1);
            self.i2c_busy = false;
            return;
        }
        if command & 1 << 8 == 0 {
            self.sensor.write(command as u8);
        } else {
            let value = self.sensor.read();
            self.i2c_read.push_back(value);
        }
        if command & 1 << 9 != 0 {
            *self.i2c.entry(0x34).or_default() |= 1 << 9;
            self.i2c_busy = false;
        }
    }
}

/// Methods of [`CoreBus`] that are those of the emulator's bus.
macro_rules! passed_on {
    ($this:ident: $kind:ty; $($name:ident($($argument:ident: $type:ty),*) $(-> $result:ty)?;)*) => {
        $(fn $name($this: $kind, $($argument: $type),*) $(-> $result)? {
            CoreBus::$name($this.bus, $($argument),*)
        })*
    };
}

/// The bus as the core sees it.
struct Wired<'a> {
    bus: &'a mut Bus,
    outside: &'a mut Outside,
}

impl CoreBus for Wired<'_> {
    fn read8(&mut self, address: u32, core: u8) -> u8 {
        match Outside::place(address) {
            Some((base, offset)) => (self.outside.read(base, offset & !3) >> (8 * (offset & 3))) as u8,
            None => Bus::read8(self.bus, address, core),
        }
    }

    fn read16(&mut self, address: u32, core: u8) -> u16 {
        match Outside::place(address) {
            Some((base, offset)) => (self.outside.read(base, offset & !3) >> (8 * (offset & 3))) as u16,
            None => Bus::read16(self.bus, address, core),
        }
    }

    fn read32(&mut self, address: u32, core: u8) -> u32 {
        match Outside::place(address) {
            Some((base, offset)) => self.outside.read(base, offset),
            None => Bus::read32(self.bus, address, core),
        }
    }

    // A peripheral sees a narrow write in all lanes (2.1.5).
    fn write8(&mut self, address: u32, value: u8, core: u8) {
        match Outside::place(address) {
            Some((base, offset)) => self.outside.write(address, base, offset & !3, u32::from(value) * 0x0101_0101),
            None => Bus::write8(self.bus, address, value, core),
        }
    }

    fn write16(&mut self, address: u32, value: u16, core: u8) {
        match Outside::place(address) {
            Some((base, offset)) => self.outside.write(address, base, offset & !3, u32::from(value) * 0x0001_0001),
            None => Bus::write16(self.bus, address, value, core),
        }
    }

    fn write32(&mut self, address: u32, value: u32, core: u8) {
        match Outside::place(address) {
            Some((base, offset)) => self.outside.write(address, base, offset, value),
            None if address == TIMER_CYCLES => {
                assert_eq!(value, CRYSTAL_MEGAHERTZ, "the cycles of a microsecond");
                Bus::write32(self.bus, address, (HERTZ / 1_000_000) as u32, core);
            }
            None => Bus::write32(self.bus, address, value, core),
        }
    }

    passed_on! {
        self: &Self;
        bus_fault(core: u8) -> bool;
        bus_fault_addr(core: u8) -> u32;
        atomics() -> &Arc<CoreAtomics>;
        gpio_read_out() -> u32;
        gpio_read_oe() -> u32;
        gpio_read_in() -> u32;
        extra_wait_states() -> u32;
        last_fetch_addr() -> u32;
        mmio_trace_enabled() -> bool;
    }

    passed_on! {
        self: &mut Self;
        set_active_pc(pc: u32, core: u8);
        clear_bus_fault(core: u8);
        set_burst_mode(on: bool);
        add_extra_wait_states(states: u32);
        take_extra_wait_states() -> u32;
        gpio_write_out(value: u32);
        gpio_set_out(mask: u32);
        gpio_clear_out(mask: u32);
        gpio_xor_out(mask: u32);
        gpio_write_oe(value: u32);
        gpio_set_oe(mask: u32);
        gpio_clear_oe(mask: u32);
        gpio_xor_oe(mask: u32);
        reset_extra_wait_states();
        set_last_fetch_addr(address: u32);
        emit_mmio_trace(direction: char, size: u32, address: u32, value: u32, core: u8);
    }
}

/// The board with a program and a clip of pictures.
pub(crate) struct Board {
    emulator: Emulator,
    outside: Outside,
    pub(crate) flash: Flash,
    clip: Vec<Vec<u8>>,
    faults: HashMap<usize, String>,
    pins: u32,
    /// The time of the clip's first frame.
    began: Option<u64>,
    stalled_until: u64,
    pub(crate) resets: u32,
    /// The instructions since the clip began.
    pub(crate) instructions: u64,
    pub(crate) lights: Vec<[bool; 2]>,
    scl_was_low: bool,
    /// Whether machine 0 of the PIO is kept from running.
    is_parked: bool,
    /// The address and the value of the last exclusive load that acquired.
    exclusive: Option<(u32, u32)>,
}

impl Board {
    /// Creates the board, with power on.
    pub(crate) fn new(flash: Flash, clip: Vec<Vec<u8>>, faults: HashMap<usize, String>) -> Result<Self, String> {
        check_block(flash.bytes())?;
        let outside = Outside {
            sensor: Hm01b0::new(),
            sent: Vec::new(),
            received: VecDeque::new(),
            incoming: VecDeque::new(),
            next_byte: 0,
            i2c: HashMap::new(),
            i2c_read: VecDeque::new(),
            i2c_busy: false,
            bus_byte: 0,
            commands: VecDeque::new(),
            uart: HashMap::new(),
            clock_output: HashMap::new(),
            dma: Dma::default(),
            dog: HashMap::new(),
            now: 0,
            ends: None,
            wants_reset: None,
            has_sensor_clock: false,
            has_set_up: false,
        };
        let emulator = powered(flash.bytes(), None);
        let (pins, began) = (1 << SDA | 1 << SCL, None);
        let (lights, resets, stalled_until) = (Vec::new(), 0, 0);
        let (scl_was_low, is_parked, exclusive) = (false, false, None);
        let mut board = Self {
            emulator,
            outside,
            flash,
            clip,
            faults,
            pins,
            began,
            stalled_until,
            resets,
            instructions: 0,
            lights,
            scl_was_low,
            is_parked,
            exclusive,
        };
        // After power was off, memory has arbitrary bytes.
        for at in (RAM..RAM + RAM_SIZE).step_by(4) {
            board.emulator.poke(at, 0xA5A5_5A5A);
        }
        Ok(board)
    }

    /// Lets the host send bytes.
    pub(crate) fn receive(&mut self, bytes: &[u8]) {
        self.outside.incoming.extend(bytes);
    }

    /// Resets the chip for this reason of the watchdog: memory keeps what it has.
    fn reset(&mut self, reason: u32) {
        self.resets += 1;
        self.stalled_until = 0;
        self.emulator = powered(self.flash.bytes(), Some(&self.emulator));
        let outside = &mut self.outside;
        (outside.i2c, outside.uart, outside.dog) = (HashMap::new(), HashMap::new(), HashMap::new());
        (outside.ends, outside.wants_reset) = (None, None);
        (outside.clock_output, outside.dma) = (HashMap::new(), Dma::default());
        outside.dog.insert(8, reason);
    }

    /// Lets the core run for so many cycles, then all others.
    fn advance(&mut self, cycles: u32) {
        let now = self.outside.now;
        if self.outside.ends.is_some_and(|ends| ends <= now) {
            self.outside.wants_reset = Some(0b01);
        }
        if let Some(reason) = self.outside.wants_reset.take() {
            self.reset(reason);
        }
        if self.outside.listens()
            && now >= self.outside.next_byte
            && let Some(byte) = self.outside.incoming.pop_front()
        {
            self.outside.received.push_back(byte);
            self.outside.next_byte = now + BYTE;
        }
        let Emulator { cores, bus, .. } = &mut self.emulator;
        let core = &mut cores.expect_arm_mut()[0];
        if self.outside.raised() & self.outside.uart.get(&0x38).copied().unwrap_or(0) != 0 {
            bus.assert_irq_shared(UART0_INTERRUPT);
        }
        if now >= self.stalled_until {
            let atomics = Arc::clone(&bus.atomics);
            // An interrupt wakes the core.
            if atomics.is_wfe_waiting(0) && (atomics.event_flag_consume(0) || atomics.irq_pending_load(0) != 0) {
                atomics.clear_wfe_waiting(0);
            }
            let begin = core.cycles();
            while core.cycles() - begin < u64::from(cycles) && !atomics.is_wfe_waiting(0) && !atomics.is_halted(0) {
                self.instructions += 1;
                let mut wired = Wired { bus, outside: &mut self.outside };
                if let Some(milliseconds) = self.flash.calls(core, &mut wired) {
                    if let Some(bytes) = self.flash.changed() {
                        bus.load_flash(bytes);
                    }
                    if milliseconds > 0 {
                        self.stalled_until = now + milliseconds * (HERTZ / 1000);
                        break;
                    }
                    continue;
                }
                if !executes(core, &mut wired, self.flash.bytes(), &mut self.exclusive) {
                    core.step(&mut wired);
                }
                if std::mem::take(&mut self.outside.has_set_up) {
                    self.flash.set_up();
                }
                if !bus.pending_cache_invalidations.is_empty() {
                    core.invalidate_decode_cache_entries(&bus.pending_cache_invalidations);
                    bus.pending_cache_invalidations.clear();
                }
                if self.outside.wants_reset.is_some() {
                    break;
                }
            }
        }
        if cycles == IDLE {
            self.sensor_clock();
        }
        self.drive_lines();
        self.wait_for_flag();
        // The emulator's own step lets the peripherals run. Its cores are halted, because this one has run.
        let atomics = Arc::clone(&self.emulator.bus.atomics);
        atomics.set_halted(0);
        atomics.set_halted(1);
        self.emulator.step_quantum = cycles;
        self.emulator.step().expect("it is serial");
        atomics.clear_halted(0);
        self.wait_for_flag();
        self.outside.dma.run(&mut self.emulator.bus);
        self.outside.now += u64::from(cycles);
    }

    /// Keeps machine 0 of the PIO from running while it waits for a flag, and clears the flag and lets it go on once
    /// that is set.
    fn wait_for_flag(&mut self) {
        let pio = &mut self.emulator.bus.pio[0];
        let running = pio.sm_enabled_mask();
        // The program has stopped the machines, or started them again.
        self.is_parked &= running & 0b0001 == 0 && running & 0b1110 != 0;
        let pc = pio.sm[0].pc();
        let instruction = pio.instr_mem()[usize::from(pc)];
        // WAIT 1 IRQ, of a flag of this block.
        if running & 1 != 0 && instruction & 0xFFF8 == 0x20C0 {
            pio.set_sm_enabled(0, false);
            self.is_parked = true;
        }
        let flag = 1 << (instruction & 7);
        if self.is_parked && pio.read32(0x30) & flag != 0 {
            pio.write32(0x30, flag, 0);
            // JMP to the next instruction.
            pio.write32(0xD8, u32::from(pc) + 1, 0);
            pio.set_sm_enabled(0, true);
            self.is_parked = false;
        }
    }

    /// Sets the levels of the pins: those of the camera, and the bus with open drains.
    fn drive_lines(&mut self) {
        let driven = self.emulator.bus.sio.gpio_lo_oe_get() & !self.emulator.bus.sio.gpio_lo_out_get();
        let is_low = |pin: u32| driven & 1 << pin != 0;
        if self.scl_was_low && !is_low(SCL) {
            self.outside.sensor.holds = self.outside.sensor.holds.saturating_sub(1);
        }
        self.scl_was_low = is_low(SCL);
        self.set(SCL, !is_low(SCL));
        self.set(SDA, !is_low(SDA) && self.outside.sensor.holds == 0);
        let camera = 0xFF << DATA | 1 << PCLK | 1 << HREF | 1 << VSYNC;
        self.emulator.bus.gpio_external_mask = camera | 1 << SDA | 1 << SCL;
        self.emulator.bus.gpio_external_in.store(self.pins, Ordering::Relaxed);
    }

    fn set(&mut self, pin: u32, is_high: bool) {
        self.pins = if is_high { self.pins | 1 << pin } else { self.pins & !(1 << pin) };
    }

    fn until(&mut self, time: u64) {
        while self.outside.now < time {
            self.advance(u32::try_from(time - self.outside.now).unwrap_or(IDLE).min(IDLE));
        }
    }

    /// Returns the frequency of the sensor's clock: of the clock output from the system's clock, if its pin has that
    /// function, which is the ninth (8.1, 9.4).
    fn sensor_clock(&mut self) -> u32 {
        let [control, divider] = [0, 4].map(|offset| self.outside.clock_output.get(&offset).copied().unwrap_or(0));
        let divider = divider >> 16;
        let function = self.emulator.mmio_read32(IO_BANK0 + 8 * CLOCK_PIN + 4) & 31;
        let is_on = control & 1 << 11 != 0 && control >> 5 & 15 == 8 && function == 9 && divider > 0;
        let hertz = if is_on { self.emulator.bus.sys_clk_hz() / divider } else { 0 };
        self.outside.has_sensor_clock = hertz > 0;
        hertz
    }

    /// Returns whether the program uses the picture: machines 0 and 1 run, and no line interrupts.
    pub(crate) fn uses(&mut self) -> bool {
        let pio = &mut self.emulator.bus.pio[0];
        let is_probing = pio.read32(0x170) & 1 << 9 != 0;
        (self.is_parked || pio.sm_enabled_mask() & 0b01 != 0) && pio.sm_enabled_mask() & 0b10 != 0 && !is_probing
    }

    /// Returns which of the camera's pins float, or are no inputs of the PIO.
    pub(crate) fn floating(&mut self) -> Vec<u32> {
        let wires = self.outside.sensor.wires();
        let pins = (DATA..DATA + wires).chain([PCLK, HREF, VSYNC]);
        pins.filter(|pin| {
            let pad = self.emulator.mmio_read32(PADS_BANK0 + 4 + 4 * pin);
            let function = self.emulator.mmio_read32(IO_BANK0 + 8 * pin + 4) & 31;
            // Input enabled, pulled up and not down, not isolated; function 6 is PIO0. An input that is pulled down
            // stays at 2.2 V once it was high, by what it leaks (data sheet, erratum RP2350-E9).
            pad & 1 << 6 == 0 || pad & 0b1100 != 0b1000 || pad & 1 << 8 != 0 || function != 6
        })
        .collect()
    }

    /// Returns which lights are lit.
    fn lit(&self) -> [bool; 2] {
        let sio = &self.emulator.bus.sio;
        let driven = sio.gpio_lo_oe_get() & sio.gpio_lo_out_get();
        [EVENTS, TROUBLE].map(|pin| driven & 1 << pin != 0)
    }

    /// Plays the clip, and the frames before it. Returns what came out of the serial line.
    pub(crate) fn play(&mut self) -> &[u8] {
        let latest = (self.clip.len() as u64 + 150) * FRAME;
        while self.outside.now < latest {
            let number = self.began.map(|began| ((self.outside.now - began + FRAME / 2) / FRAME) as usize);
            if number.is_some_and(|number| number >= self.clip.len()) {
                // The last results are sent.
                self.until(self.outside.now + FRAME / 2);
                break;
            }
            self.frame(number);
        }
        &self.outside.sent
    }

    /// Sends a frame, or lets its time pass. `number` is that of the clip.
    pub(crate) fn frame(&mut self, number: Option<usize>) {
        self.lights.push(self.lit());
        let begins = self.outside.now;
        let fault = number.and_then(|number| self.faults.remove(&number));
        if let Some(request) = fault.as_deref().and_then(|fault| fault.strip_prefix("send ")) {
            self.receive(&crate::bytes(request).expect("faults are checked"));
        }
        match fault.as_deref() {
            Some("unplug") => {
                self.outside.sensor.present = false;
                self.outside.sensor.power_on();
            }
            Some("plug in") => self.outside.sensor.present = true,
            Some("hold data line") => self.outside.sensor.holds = 4,
            Some("slow bus") => self.outside.bus_byte = 9 * HERTZ / 100_000,
            Some("hang") => self.stalled_until = begins + 5 * HERTZ,
            Some("crash") => {
                // UDF.
                self.emulator.poke(RAM + RAM_SIZE - 0x100, 0xDEFF_DEFF);
                self.emulator.cores.expect_arm_mut()[0].set_reg(15, RAM + RAM_SIZE - 0x100);
                self.emulator.bus.atomics.clear_wfe_waiting(0);
            }
            _ => {}
        }
        let clock = self.sensor_clock();
        if !self.outside.sensor.streams() || clock == 0 || fault.as_deref() == Some("silent") {
            self.until(begins + FRAME);
            return;
        }
        if self.began.is_none() && self.uses() {
            (self.began, self.instructions) = (Some(begins), 0);
            return self.frame(Some(0));
        }
        let (clocks, lines) = self.outside.sensor.lengths();
        let pixel_clock = self.outside.sensor.pixel_clock(clock);
        let pixel = HERTZ / u64::from(pixel_clock);
        let period = pixel * u64::from(clocks) * u64::from(lines);
        // The clip has 30 frames per second. The sensor's rate is a little lower, by arithmetic alone.
        let period = if period.abs_diff(FRAME) * 100 < FRAME { FRAME } else { period };
        if self.emulator.bus.pio[0].sm_enabled_mask() != 0 {
            self.picture(number, pixel, pixel * u64::from(clocks), fault.as_deref());
        }
        self.until(begins + period);
    }

    fn picture(&mut self, number: Option<usize>, pixel: u64, line: u64, fault: Option<&str>) {
        let picture = number.and_then(|number| self.clip.get(number)).map(Vec::as_slice);
        let pixels = self.outside.sensor.pixels(picture);
        let (columns, rows) = self.outside.sensor.size();
        let parts: Vec<_> = (0..=255).map(|value| self.outside.sensor.bits(value)).collect();
        let rises = self.outside.sensor.rises();
        let half = (pixel as u32 / (8 / self.outside.sensor.wires())) / 2;
        let rest = pixel as u32 / (8 / self.outside.sensor.wires()) - half;
        let begins = self.outside.now + u64::from(self.outside.sensor.early()) * line;
        self.set(PCLK, !rises);
        self.set(VSYNC, true);
        for (y, row) in pixels.chunks(columns as usize).enumerate() {
            self.until(begins + y as u64 * line - u64::from(self.outside.sensor.href_early()) * pixel);
            if fault == Some("sync inside") && y == rows as usize / 2 {
                self.set(VSYNC, false);
                self.until(self.outside.now + 100);
                self.set(VSYNC, true);
            }
            if fault == Some("lost line") && y == 100 {
                continue;
            }
            if fault == Some("late core") && y == 110 {
                self.stalled_until = self.outside.now + 30 * line;
            }
            self.set(HREF, true);
            self.until(self.outside.now + u64::from(self.outside.sensor.href_early()) * pixel);
            for (x, value) in row.iter().enumerate() {
                if fault == Some("split line") && y == 100 && x == 160 {
                    self.set(HREF, false);
                    self.advance(half);
                    self.set(HREF, true);
                }
                for wires in &parts[usize::from(*value)] {
                    self.pins = self.pins & !(0xFF << DATA) | wires << DATA;
                    self.set(PCLK, !rises);
                    self.advance(half);
                    self.set(PCLK, rises);
                    self.advance(rest);
                }
            }
            self.set(PCLK, !rises);
            self.advance(half);
            self.set(HREF, false);
            self.advance(half);
        }
        self.until(begins + u64::from(rows) * line);
        self.set(VSYNC, false);
    }
}

/// Returns the chip after power was switched on, or after a reset: then it has the memory of before.
fn powered(image: &[u8], before: Option<&Emulator>) -> Emulator {
    let mut emulator = EmulatorBuilder::new(Config::default()).build().expect("a serial emulator is built");
    emulator.load_bootrom(&flash::rom());
    emulator.load_flash(image);
    for at in (RAM..RAM + RAM_SIZE).step_by(4) {
        if let Some(before) = before {
            emulator.poke(at, before.peek(at));
        }
    }
    // What the boot ROM does when it has found the block: the vector table is at the beginning of the image.
    let word = |at: usize| u32::from_le_bytes(image[at..at + 4].try_into().expect("four bytes"));
    let core = &mut emulator.cores.expect_arm_mut()[0];
    core.regs.msp = word(0);
    core.set_reg(13, word(0));
    core.set_reg(15, word(4) & !1);
    emulator.mmio_write32(0xE000_ED08, FLASH);
    emulator.bus.atomics.set_halted(1);
    emulator
}

/// Looks for the block that the boot ROM demands in the first 4 KiB, and checks its items (5.9.1 and 5.9.3).
fn check_block(image: &[u8]) -> Result<(), String> {
    let words: Vec<_> = image
        .get(..4096)
        .unwrap_or(image)
        .chunks_exact(4)
        .map(|bytes| u32::from_le_bytes(bytes.try_into().expect("four bytes")))
        .collect();
    let begin = words.iter().position(|word| *word == 0xFFFF_DED3).ok_or("no block in the first 4 KiB of the image")?;
    let mut at = begin + 1;
    let mut image_type = None;
    loop {
        let item = *words.get(at).ok_or("the block has no end")?;
        match item & 0xFF {
            // The last item has the number of words of all others. A link to itself and the end follow.
            0xFF => {
                let size = item >> 8 & 0xFFFF;
                if size as usize != at - begin - 1 {
                    return Err(format!("the block's last item says {size} words"));
                }
                break;
            }
            // IMAGE_DEF: its size in words, and flags.
            0x42 if item >> 8 & 0xFF == 1 => image_type = Some(item >> 16),
            _ => {}
        }
        let size = if item & 0x80 == 0 { item >> 8 & 0xFF } else { item >> 8 & 0xFFFF };
        at += size.max(1) as usize;
    }
    if words.get(at + 1) != Some(&0) || words.get(at + 2) != Some(&0xAB12_3579) {
        return Err("the block does not link to itself, or has no end".to_owned());
    }
    // An executable (bits 3-0: 1) for secure mode (5-4: 2), of Arm (10-8: 0) and the RP2350 (14-12: 1).
    match image_type {
        Some(0x1021) => Ok(()),
        other => Err(format!("the image is not a secure program of an RP2350: {other:#x?}")),
    }
}

/// Executes an instruction of single registers if the emulator cannot: VPUSH and VPOP; VMOV, VLDR and VSTR of pairs;
/// VSEL, VMAXNM and VMINNM. Returns whether it did.
fn executes_of_singles(core: &mut CortexM33, bus: &mut Wired<'_>, first: u16, second: u16) -> bool {
    let pc = core.reg(15);
    if matches!(first & 0xFFBF, 0xED2D | 0xECBD) && second & 0x0F00 == 0x0B00 {
        let length = u32::from(second & 0xFF);
        let register = 2 * usize::from(first >> 2 & 0x10 | second >> 12);
        let is_push = first & 0xFFBF == 0xED2D;
        let below = core.reg(13).wrapping_sub(if is_push { 4 * length } else { 0 });
        for (single, at) in core.regs.s[register..].iter_mut().zip((0..length).map(|word| below + 4 * word)) {
            if is_push {
                bus.write32(at, single.to_bits(), 0);
            } else {
                *single = f32::from_bits(bus.read32(at, 0));
            }
        }
        core.set_reg(13, if is_push { below } else { below + 4 * length });
        return true;
    }
    // A pair of core registers and one of single ones.
    if first & 0xFFE0 == 0xEC40 && second & 0x0FD0 == 0x0B10 {
        let pair = 2 * usize::from(second >> 1 & 0x10 | second & 15);
        let registers = [usize::from(second >> 12), usize::from(first & 15)];
        for (single, register) in core.regs.s[pair..pair + 2].iter_mut().zip(registers) {
            if first & 0x10 == 0 {
                *single = f32::from_bits(core.regs.r[register]);
            } else {
                core.regs.r[register] = single.to_bits();
            }
        }
        return true;
    }
    // Loads and stores of a pair of single registers.
    if first & 0xFF20 == 0xED00 && second & 0x0F00 == 0x0B00 {
        let pair = 2 * usize::from(first >> 2 & 0x10 | second >> 12);
        let base = if first & 15 == 15 { (pc + 4) & !3 } else { core.reg(usize::from(first & 15)) };
        let offset = 4 * u32::from(second & 0xFF);
        let at = if first & 0x80 != 0 { base.wrapping_add(offset) } else { base.wrapping_sub(offset) };
        for (single, at) in core.regs.s[pair..pair + 2].iter_mut().zip([at, at + 4]) {
            if first & 0x10 == 0 {
                bus.write32(at, single.to_bits(), 0);
            } else {
                *single = f32::from_bits(bus.read32(at, 0));
            }
        }
        return true;
    }
    if first & 0xFF00 == 0xFE00 && second & 0x0F10 == 0x0A00 {
        let single = |number: u16, low: u16| usize::from((number & 15) << 1 | low & 1);
        let to = single(second >> 12, first >> 6);
        let [a, b] = [single(first, second >> 7), single(second, second >> 5)].map(|number| core.regs.s[number]);
        let (is_same, is_min) = (core.flag_n() == core.flag_v(), second & 0x40 != 0);
        core.regs.s[to] = match (first & 0x80 != 0, first >> 4 & 3) {
            (false, condition) => {
                let holds = [core.flag_z(), core.flag_v(), is_same, is_same && !core.flag_z()];
                if holds[usize::from(condition)] { a } else { b }
            }
            // Zeros are equal, but have a sign.
            (true, 0) if a == 0.0 && b == 0.0 => {
                f32::from_bits(if is_min { a.to_bits() | b.to_bits() } else { a.to_bits() & b.to_bits() })
            }
            (true, 0) => {
                if is_min {
                    a.min(b)
                } else {
                    a.max(b)
                }
            }
            (true, _) => return false,
        };
        return true;
    }
    false
}

/// Executes the next instruction in the flash if the emulator cannot. Returns whether it did. The encodings are those
/// of the Armv8-M manual: CPS; those of single registers; LDA, STL, LDAEX and STLEX with their bytes and halfwords.
fn executes(core: &mut CortexM33, bus: &mut Wired<'_>, image: &[u8], exclusive: &mut Option<(u32, u32)>) -> bool {
    let pc = core.reg(15);
    let at = pc.wrapping_sub(FLASH) as usize;
    let Some(&[a, b, c, d]) = image.get(at..at + 4) else { return false };
    let (first, second) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
    if first & 0xFFE8 == 0xB660 {
        let disable = u32::from(first >> 4 & 1);
        if first & 0b10 != 0 {
            core.regs.primask = disable;
        }
        if first & 0b01 != 0 {
            core.regs.faultmask = disable;
        }
        core.set_reg(15, pc + 2);
        return true;
    }
    if executes_of_singles(core, bus, first, second) {
        core.set_reg(15, pc + 4);
        return true;
    }
    let (is_load, base) = (first & 0x10 != 0, core.reg(usize::from(first & 15)));
    if first & 0xFFE0 != 0xE8C0 || second & 0x0F80 != 0x0F80 {
        return false;
    }
    // Bits 7 to 4: 10xx is plain, 11xx exclusive; xx is the size. An exclusive store has a register in bits 3 to 0.
    let (kind, size, low) = (second >> 6 & 1, second >> 4 & 3, usize::from(second & 15));
    if size == 3 || low != 15 && (is_load || kind == 0) {
        return false;
    }
    assert_eq!(core.it_state(), 0, "it is under no condition");
    let register = usize::from(second >> 12);
    let read = |bus: &mut Wired<'_>| match size {
        0 => u32::from(bus.read8(base, 0)),
        1 => u32::from(bus.read16(base, 0)),
        _ => bus.read32(base, 0),
    };
    if is_load {
        let value = read(bus);
        core.set_reg(register, value);
        if kind == 1 {
            *exclusive = Some((base, value));
        }
    } else {
        // An interrupt in between that has changed the value lets an exclusive store fail.
        let is_done = kind == 0 || exclusive.take() == Some((base, read(bus)));
        let value = core.reg(register);
        if is_done {
            match size {
                0 => bus.write8(base, value as u8, 0),
                1 => bus.write16(base, value as u16, 0),
                _ => bus.write32(base, value, 0),
            }
        }
        if kind == 1 {
            core.set_reg(low, u32::from(!is_done));
        }
    }
    core.set_reg(15, pc + 4);
    true
}
