//! An HM01B0: what its registers make of its pins. It is `tests/pico/sensor.mjs` without what only the Pico's cases
//! need; the sources of registers and bits are named there.

use std::collections::HashMap;

const ADDRESS: u8 = 0x24;
/// The registers after a reset, as far as public drivers say it.
const DEFAULTS: [(u16, u8); 24] = [
    (0x0000, 0x01),
    (0x0001, 0xB0),
    (0x0202, 0x01),
    (0x0203, 0x08),
    (0x020E, 0x01),
    (0x0340, 0x02),
    (0x0341, 0x32),
    (0x0342, 0x01),
    (0x0343, 0x72),
    (0x0383, 0x01),
    (0x0387, 0x01),
    (0x1000, 0x01),
    (0x1003, 0x20),
    (0x1006, 0x00),
    (0x1007, 0x20),
    (0x2100, 0x01),
    (0x3011, 0x70),
    (0x3022, 0x02),
    (0x3023, 0x02),
    (0x3059, 0x02),
    (0x3060, 0x0A),
    (0x3064, 0x00),
    (0x3067, 0x00),
    (0x3068, 0x20),
];
/// Registers that act only when 1 is written to 0x0104, which is a guess.
const HELD: [u16; 15] = [
    0x0101, 0x0202, 0x0203, 0x0205, 0x020E, 0x020F, 0x0340, 0x0341, 0x0342, 0x0343, 0x0383, 0x0387, 0x0390, 0x0601,
    0x3010,
];
const NOMINAL_LINES: f64 = 240.0;
const NOMINAL_BLACK: f64 = 8.0;

/// The sensor.
pub(crate) struct Hm01b0 {
    /// Whether it is there.
    pub(crate) present: bool,
    /// The clocks for which it holds the data line.
    pub(crate) holds: u32,
    registers: HashMap<u16, u8>,
    active: HashMap<u16, u8>,
    pointer: u16,
    bytes: usize,
}

impl Hm01b0 {
    pub(crate) fn new() -> Self {
        let registers: HashMap<_, _> = DEFAULTS.into();
        Self { present: true, holds: 0, active: registers.clone(), registers, pointer: 0, bytes: 0 }
    }

    /// Sets all registers to their defaults.
    pub(crate) fn power_on(&mut self) {
        self.registers = DEFAULTS.into();
        self.active = self.registers.clone();
    }

    /// Returns whether it acknowledges this address.
    pub(crate) fn answers(&self, address: u8) -> bool {
        self.present && address == ADDRESS
    }

    /// Begins a transfer.
    pub(crate) fn start(&mut self) {
        self.bytes = 0;
    }

    /// Accepts a byte: the high and low byte of an address, then values.
    pub(crate) fn write(&mut self, value: u8) {
        self.bytes += 1;
        match self.bytes {
            1 => self.pointer = u16::from(value) << 8,
            2 => self.pointer |= u16::from(value),
            _ => {
                self.set(self.pointer, value);
                self.pointer = self.pointer.wrapping_add(1);
            }
        }
    }

    /// Returns the register at the pointer, which moves on.
    pub(crate) fn read(&mut self) -> u8 {
        let value = self.registers.get(&self.pointer).copied().unwrap_or(0);
        self.pointer = self.pointer.wrapping_add(1);
        value
    }

    fn set(&mut self, register: u16, value: u8) {
        match register {
            0x0000 | 0x0001 => {}
            0x0103 => self.power_on(),
            _ => {
                self.registers.insert(register, value);
                if !HELD.contains(&register) {
                    self.active.insert(register, value);
                }
                if register == 0x0104 && value & 1 != 0 {
                    for held in HELD {
                        self.active.insert(held, self.registers.get(&held).copied().unwrap_or(0));
                    }
                }
            }
        }
    }

    fn at(&self, register: u16) -> u8 {
        self.active.get(&register).copied().unwrap_or(0)
    }

    fn number(&self, high: u16) -> u32 {
        u32::from(self.at(high)) << 8 | u32::from(self.at(high + 1))
    }

    /// Returns whether frames are sent.
    pub(crate) fn streams(&self) -> bool {
        self.present && self.at(0x0100) & 7 == 1 && self.at(0x3064) & 4 == 0
    }

    /// Returns the pixel clocks of a line and the lines of a frame, blank ones too.
    pub(crate) fn lengths(&self) -> (u32, u32) {
        (self.number(0x0342).max(369), self.number(0x0340).max(self.size().1 + 16))
    }

    /// Returns the frequency of pixels from a clock of this frequency.
    pub(crate) fn pixel_clock(&self, clock: u32) -> u32 {
        clock / [8, 4, 2, 1][usize::from(self.at(0x3060) & 3)]
    }

    /// Returns columns and rows of what is sent.
    pub(crate) fn size(&self) -> (u32, u32) {
        let half = |register| if self.at(register) & 3 == 3 { 2 } else { 1 };
        (324 / half(0x0383), (if self.at(0x3010) & 1 != 0 { 244 } else { 324 }) / half(0x0387))
    }

    /// Returns the number of data wires.
    pub(crate) fn wires(&self) -> u32 {
        match self.at(0x3059) {
            bits if bits & 0x20 != 0 => 1,
            bits if bits & 0x40 != 0 => 4,
            _ => 8,
        }
    }

    /// Returns the values of the data wires for a pixel, one for each pixel clock.
    pub(crate) fn bits(&self, pixel: u8) -> Vec<u32> {
        let wires = self.wires();
        let value = u32::from(pixel);
        let mut parts: Vec<_> = (0..8).step_by(wires as usize).map(|at| value >> at & ((1 << wires) - 1)).collect();
        if self.at(0x3060) & 0x10 != 0 {
            parts.reverse();
        }
        parts
    }

    /// Returns whether data is to be taken at the rising edge of PCLK.
    pub(crate) fn rises(&self) -> bool {
        self.at(0x3068) & 1 == 0
    }

    /// Returns how many lines VSYNC comes before the first line.
    pub(crate) fn early(&self) -> u8 {
        self.at(0x3022) & 0x1F
    }

    /// Returns how many pixels HREF comes before the first pixel. PCLK is gated, which a driver for the RP2040 relies
    /// on.
    pub(crate) fn href_early(&self) -> u8 {
        self.at(0x3023) & 0x1F
    }

    /// Returns the pixels that are sent of a picture of 320 x 240, or of darkness. The border has another value.
    pub(crate) fn pixels(&self, picture: Option<&[u8]>) -> Vec<u8> {
        let (columns, rows) = self.size();
        let gain = f64::from(self.number(0x0202)) / NOMINAL_LINES
            * f64::from(1 << (self.at(0x0205) >> 4 & 7))
            * (f64::from(self.at(0x020E) & 3) + f64::from(self.at(0x020F)) / 256.0)
            * if self.at(0x2100) & 1 == 0 { 1.0 } else { 1.2 };
        let black = |switch, target| if self.at(switch) & 1 == 0 { 16.0 } else { f64::from(self.at(target)) };
        let more = f64::midpoint(black(0x1000, 0x1003), black(0x1006, 0x1007)) - NOMINAL_BLACK;
        let blacks = if self.at(0x1000) & 1 == 0 { 0 } else { self.at(0x1003) };
        let (flip_x, flip_y) = (self.at(0x0101) & 1 != 0, self.at(0x0101) & 2 != 0);
        let mut walking = 1_u8;
        let mut pixels = Vec::with_capacity((columns * rows) as usize);
        for y in 0..rows {
            for x in 0..columns {
                let x = (if flip_x { columns - 1 - x } else { x }).wrapping_sub(2);
                let y = (if flip_y { rows - 1 - y } else { y }).wrapping_sub(2);
                let scene = match picture {
                    _ if x >= 320 || y >= 240 => 199,
                    Some(picture) => picture[(y * 320 + x) as usize],
                    None => 0,
                };
                pixels.push(match self.at(0x0601) & 0x11 {
                    0x11 => {
                        let value = walking.saturating_add(blacks);
                        walking = if walking == 0 { 1 } else { walking << 1 };
                        value
                    }
                    0x01 => x as u8,
                    _ => (f64::from(scene) * gain + more).round().clamp(0.0, 255.0) as u8,
                });
            }
        }
        pixels
    }
}
