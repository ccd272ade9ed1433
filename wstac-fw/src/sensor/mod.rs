//! Camera sensors. Tables make each of them send QVGA at the rate of [`setup`] with a fixed light response.
//! One procedure identifies them and sets them up, whether their registers have addresses of 8 or of 16 bits, and
//! values of one or of two bytes.
//!
//! A rate is made by lines without pixels. Their number keeps every rate from 15 to 60 frames per second within 0.4 %,
//! and the rows of a frame as close together as the clock allows. Above 30, a sensor skips every second line, or its
//! clock is twice as fast.
//!
//! Automatic exposure, gain, white balance and a gamma curve would change the features without any touch. So every
//! table first switches the automatic controls off, then sets values, and makes gamma a straight line.

pub mod gc2145;
pub mod hm01b0;
pub mod hm0360;
pub mod mt9m114;
pub mod ov2640;
pub mod ov5640;
pub mod ov7670;
pub mod ov7690;
pub mod ov7692;
pub mod ov7725;
pub mod watch;

use core::{iter, mem};

use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::I2c;
use wstac_core::layout::FrameSize;
use wstac_core::touch::motion::ReadoutTime;
use wstac_core::wire::{Fault, FrameNumbers, FramePart, RegisterValues};

pub use crate::sccb::Addressing;
use crate::sccb::Registers;
use crate::setup;

/// A register and the value that is written to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The register.
    pub register: u16,
    /// The value of the register.
    pub value: u8,
}

const fn set(register: u16, value: u8) -> Setting {
    Setting { register, value }
}

/// Returns the settings of runs, of which there are `N`: each is a register, and the values from it upwards.
const fn runs<const N: usize>(runs: &[(u16, &[u8])]) -> [Setting; N] {
    let (mut settings, mut next, mut run) = ([set(0, 0); N], 0, 0);
    while run < runs.len() {
        let (first, values) = runs[run];
        let mut at = 0;
        while at < values.len() {
            settings[next] = set(first + at as u16, values[at]);
            (next, at) = (next + 1, at + 1);
        }
        run += 1;
    }
    assert!(next == N, "the number of a table's settings is another");
    settings
}

/// Returns the settings of a text of hexadecimal numbers, of which there are `N`: a register with a colon, and the
/// values from it upwards.
const fn dump<const N: usize>(text: &str) -> [Setting; N] {
    let (text, mut at, mut register) = (text.as_bytes(), 0, 0);
    let (mut settings, mut next, mut number) = ([set(0, 0); N], 0, None);
    while at <= text.len() {
        let byte = if at < text.len() { text[at] } else { b' ' };
        match (number, (byte as char).to_digit(16)) {
            (None, Some(digit)) => number = Some(digit as u16),
            (Some(high), Some(digit)) => number = Some(high << 4 | digit as u16),
            (Some(value), None) if byte == b':' => (register, number) = (value, None),
            (Some(value), None) => {
                settings[next] = set(register, value as u8);
                (register, next, number) = (register + 1, next + 1, None);
            }
            (None, None) => {}
        }
        at += 1;
    }
    assert!(next == N, "the number of a table's settings is another");
    settings
}

/// The properties of a sensor.
#[derive(Clone, Copy, Debug)]
pub struct CameraSensor {
    /// The common name of the sensor.
    pub name: &'static str,
    /// The 7-bit address on the bus.
    pub address: u8,
    /// The bits of a register's address.
    pub addressing: Addressing,
    /// The setting that chooses the bank of the identity and of the reset, if they are not in every bank.
    pub bank: Option<Setting>,
    /// The two identity registers, high byte first, and their values.
    pub identity: [Setting; 2],
    /// The setting that restarts the sensor with every register at its default. No acknowledge or value follows. Of a
    /// register of two bytes it is the low one, and the other one is 0.
    pub reset: Setting,
    /// The milliseconds after a reset, also one by its pin, in which the sensor answers.
    pub reset_ms: u16,
    /// The commands of a sensor that has a processor of its own.
    pub commands: Option<&'static Commands>,
    /// The settings that come first, and are read back once: those that choose banks of registers and those of other
    /// banks, and those without a public meaning.
    pub once: &'static [Setting],
    /// The settings of format, size and rate, then the locks. Each is read back, again and again.
    pub settings: &'static [&'static [Setting]],
    /// The settings that are written last and not read back, because they change by themselves.
    pub start: &'static [Setting],
    /// The register of the switches of automatic controls, which a reset sets.
    pub switches: u16,
    /// The milliseconds from the last setting to frames that show it.
    pub settle_ms: u16,
    /// The size of the sensor's frames, as they are used.
    pub size: FrameSize,
    /// The time from the first of these rows to the last: a shutter that rolls reads one after the other.
    pub readout: ReadoutTime,
    /// The signals of the sensor's parallel port.
    pub signals: Signals,
    /// The registers that are named when frames are wrong although every setting was kept.
    pub suspects: Suspects,
    /// The values of the clock's register for half and for a quarter of the rate, if it has them.
    pub slower: Option<[u8; 2]>,
    /// The value of the clock's register, if it is not that of the settings because they gave another rate.
    pub clock: Option<u8>,
    /// The registers that have the exposure in lines.
    pub exposure: &'static [ExposurePart],
    /// The exposure in lines, if it is not that of the settings: at most `longest_exposure`.
    pub lines: Option<u16>,
    /// The longest exposure in lines with which the sensor keeps its rate.
    pub longest_exposure: u16,
    /// The settings of a test pattern of walking ones, or none. Their registers are in the table, too.
    pub pattern: &'static [Setting],
}

/// The commands of a sensor with a processor of its own. Its reset ends when 0 is written, and its processor starts.
#[derive(Clone, Copy, Debug)]
pub struct Commands {
    /// The command that makes the settings act. It is written with the bits that the first register has after success.
    pub change: [Setting; 2],
    /// The bits of the second register that are set while a command is under way.
    pub under_way: u8,
}

impl Commands {
    /// The milliseconds after which a command is late.
    const LATEST_MS: u32 = 500;

    /// Waits until no command is under way.
    fn wait<B: I2c>(&self, port: &mut Port<'_, B>, delay: &mut impl DelayNs) -> Result<(), SensorError<B::Error>> {
        let [success, Setting { register, .. }] = self.change;
        for _ in 0..Self::LATEST_MS {
            if port.read(register)? & self.under_way == 0 {
                break;
            }
            delay.delay_ms(1);
        }
        port.verify_bits(set(register, 0x00), self.under_way)?;
        port.verify_bits(success, success.value)
    }
}

/// A register that has a part of the exposure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExposurePart {
    /// The register.
    pub register: u16,
    /// The value of its bit 0 as a power of 2, in sixteenths of a line.
    pub from: u8,
    /// The bits of the register that have it.
    pub mask: u8,
}

impl ExposurePart {
    /// Returns the value of the register with an exposure of so many lines in place of the one that it has.
    pub const fn of(self, value: u8, lines: u16) -> u8 {
        value & !self.mask | ((lines as u32) << 4 >> self.from) as u8 & self.mask
    }

    /// Creates a register of the high or the low byte.
    const fn byte(register: u16, is_high: bool) -> Self {
        Self { register, from: if is_high { 12 } else { 4 }, mask: 0xFF }
    }
}

/// Returns the longest exposure in lines that any of these sensors can have. That of the one that is found may be less.
pub fn longest_exposure(sensors: &[CameraSensor]) -> u16 {
    sensors.iter().map(|sensor| sensor.longest_exposure).max().unwrap_or(0)
}

/// A sensor that rests sends one of so many frames. The sample of a touch that ends the rest begins ten frames before
/// it, so more than 7 of its frames were filled: its event is not reliable (SPEC §3).
pub const RESTS: u16 = 4;

/// The registers that decide what a sensor sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Suspects {
    /// The register of the width of a frame.
    pub size: u16,
    /// The register of the order of bytes.
    pub format: u16,
    /// The register of the clock.
    pub rate: u16,
}

/// The polarities, the order of bytes and the border of a parallel port, which a camera interface needs to know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(clippy::struct_excessive_bools, reason = "each is one way or the other")]
pub struct Signals {
    /// Whether VSYNC is high between frames.
    pub vsync_high_between_frames: bool,
    /// Whether HREF is high during a line's pixels.
    pub href_high_in_lines: bool,
    /// Whether data is to be taken at the rising edge of PCLK.
    pub sample_at_rising_edge: bool,
    /// Whether a pixel has a byte of chroma.
    pub has_chroma: bool,
    /// Whether the first of two bytes is a pixel's luma. The second one is then chroma.
    pub luma_first: bool,
    /// The pixels on every side of those that are used, which the camera interface leaves out.
    pub border: u16,
    /// The pixels for which PCLK runs before the first one of a line. They are measured, and left out with the border.
    pub early: u16,
}

/// The reason why a sensor could not be set up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorError<E> {
    /// The bus failed at this register. No acknowledge means that the sensor is absent.
    Bus {
        /// The register that was to be read or written.
        register: u16,
        /// The error of the bus.
        error: E,
    },
    /// The sensor is another one.
    Identity {
        /// The high and low byte found.
        found: u16,
        /// The high and low byte expected.
        expected: u16,
    },
    /// A register does not hold the value that was written to it.
    NotTaken {
        /// The register.
        register: u16,
        /// The values found and expected.
        values: RegisterValues,
    },
}

/// The former name of [`CameraSensor`].
#[deprecated(since = "0.4.0", note = "use `CameraSensor`")]
pub type Sensor = CameraSensor;

impl CameraSensor {
    /// Reads the identity: high and low byte.
    pub fn id(&self) -> u16 {
        let [high, low] = self.identity;
        u16::from_be_bytes([high.value, low.value])
    }

    /// Returns the width and height of what the sensor sends.
    pub fn sent(&self) -> [u16; 2] {
        [self.size.width(), self.size.height()].map(|side| side.saturating_add(2 * self.signals.border))
    }

    /// Returns the fault of frames of which a part is not as the settings make it, and of so many words.
    #[inline(never)]
    pub fn differs(&self, part: FramePart, words: u32, found: FrameNumbers) -> Fault<'static> {
        let register = match part {
            FramePart::Size => self.suspects.size,
            FramePart::Rate => self.suspects.rate,
            _ => self.suspects.format,
        };
        let expected = FrameNumbers { words, ..self.frames() };
        Fault::SensorDiffers { part, address: self.address, register, found, expected }
    }

    /// Returns the numbers of all that the sensor sends, as its settings make it.
    pub fn frames(&self) -> FrameNumbers {
        let [width, lines] = self.sent().map(u32::from);
        let words = width * lines / if self.signals.has_chroma { 2 } else { 4 };
        FrameNumbers { lines, words, millihertz: 1000 * setup::FPS }
    }

    /// Returns the settings of format, size and rate, then the locks.
    pub fn table(&self) -> impl Iterator<Item = Setting> + use<> {
        let (clock, rate, lines, parts) = (self.clock, self.suspects.rate, self.lines, self.exposure);
        self.settings.iter().copied().flatten().map(move |&Setting { register, value }| {
            let value = clock.filter(|_| register == rate).unwrap_or(value);
            let Some(lines) = lines else { return Setting { register, value } };
            let part = parts.iter().find(|part| part.register == register);
            Setting { register, value: part.map_or(value, |part| part.of(value, lines)) }
        })
    }

    /// Divides the clock if its rate is `times` that of the settings, 2 or 4, and was not divided before. Returns
    /// whether it does.
    pub fn slow_down(&mut self, times: u32) -> bool {
        let Some([half, quarter]) = self.slower else { return false };
        let clock = match times {
            2 => Some(half),
            4 => Some(quarter),
            _ => None,
        };
        let is_new = self.clock.is_none() && clock.is_some();
        self.clock = self.clock.or(clock);
        is_new
    }

    /// Checks that this sensor is there.
    ///
    /// # Errors
    /// Returns [`SensorError::Bus`] or [`SensorError::Identity`].
    pub fn identify<B: I2c>(&self, bus: &mut B) -> Result<(), SensorError<B::Error>> {
        let mut port = Port(Registers::new(bus, self.address, self.addressing));
        if let Some(bank) = self.bank {
            port.write(bank)?;
        }
        let [high, low] = self.identity;
        let found = u16::from_be_bytes([port.read(high.register)?, port.read(low.register)?]);
        if found == self.id() { Ok(()) } else { Err(SensorError::Identity { found, expected: self.id() }) }
    }

    /// Returns the longest time in milliseconds until [`Self::set_up`] ends: a setting is written and read in 1.1 ms.
    pub const fn longest_set_up(&self) -> u32 {
        let (mut settings, mut part) = (self.once.len() + self.start.len(), 0);
        while part < self.settings.len() {
            (settings, part) = (settings + self.settings[part].len(), part + 1);
        }
        let reset_ms = self.reset_ms as u32;
        let commands = if self.commands.is_some() { reset_ms + 2 * Commands::LATEST_MS } else { 0 };
        reset_ms + commands + settings as u32 * 11 / 10
    }

    /// Identifies the sensor, resets it and writes its settings. Each is read back.
    ///
    /// # Errors
    /// Returns any [`SensorError`]. The sensor may then be left partly set up; the next attempt begins with a reset
    /// again.
    pub fn set_up<B: I2c>(&self, bus: &mut B, delay: &mut impl DelayNs) -> Result<(), SensorError<B::Error>> {
        let is_wide = self.addressing == Addressing::Wide;
        self.identify(bus)?;
        let mut port = Port(Registers::new(bus, self.address, self.addressing));
        port.reset(self.reset)?;
        delay.delay_ms(self.reset_ms.into());
        if let Some(commands) = self.commands {
            port.reset(Setting { value: 0, ..self.reset })?;
            delay.delay_ms(self.reset_ms.into());
            commands.wait(&mut port, delay)?;
        }
        let mut settings = self.once.iter().copied().chain(self.table()).peekable();
        while let Some(first) = settings.next() {
            let second =
                settings.next_if(|second| is_wide && first.register & 1 == 0 && second.register == first.register + 1);
            port.transfer(first, second)?;
            for setting in iter::once(first).chain(second) {
                port.verify(setting)?;
            }
        }
        for &setting in self.start {
            port.write(setting)?;
        }
        let Some(commands) = self.commands else { return Ok(()) };
        let [first, second] = commands.change;
        port.transfer(first, Some(second))?;
        commands.wait(&mut port, delay)
    }

    /// Returns the settings of the sensor with which it rests: it sends one of [`RESTS`] frames. `None` if it has none.
    pub fn resting(&self) -> Option<&'static [&'static [Setting]]> {
        hm01b0::resting(self)
    }

    /// Changes to settings of the same registers while the sensor sends frames. Returns false if the bus failed: they
    /// may not act then, although the watch over settings finds them as they should be.
    #[must_use]
    pub fn change<B: I2c>(&mut self, settings: &'static [&'static [Setting]], bus: &mut B) -> bool {
        let before = mem::replace(&mut self.settings, settings);
        let mut port = Port(Registers::new(bus, self.address, self.addressing));
        let old = before.iter().copied().flatten();
        let changes = settings.iter().copied().flatten().zip(old).filter(|(new, old)| new != old);
        changes.map(|(new, _)| new).chain(self.start).all(|setting| port.write(*setting).is_ok())
    }

    /// Switches the test pattern on or off. Without one, nothing is written.
    ///
    /// # Errors
    /// Returns [`SensorError::Bus`] or [`SensorError::NotTaken`].
    pub fn show_pattern<B: I2c>(&self, bus: &mut B, is_shown: bool) -> Result<(), SensorError<B::Error>> {
        if self.pattern.is_empty() {
            return Ok(());
        }
        let mut port = Port(Registers::new(bus, self.address, self.addressing));
        for &pattern in self.pattern {
            let scene = self.table().find(|setting| setting.register == pattern.register);
            let setting = if is_shown { pattern } else { scene.unwrap_or(pattern) };
            port.write(setting)?;
            port.verify(setting)?;
        }
        for &setting in self.start {
            port.write(setting)?;
        }
        Ok(())
    }
}

/// A bus whose errors name the register.
struct Port<'b, B>(Registers<'b, B>);

impl<B: I2c> Port<'_, B> {
    fn read(&mut self, register: u16) -> Result<u8, SensorError<B::Error>> {
        self.0.read(register).map_err(|error| SensorError::Bus { register, error })
    }

    fn write(&mut self, Setting { register, value }: Setting) -> Result<(), SensorError<B::Error>> {
        self.0.write(register, value).map_err(|error| SensorError::Bus { register, error })
    }

    /// Writes a setting, with 0 in the other byte of its register.
    fn reset(&mut self, setting: Setting) -> Result<(), SensorError<B::Error>> {
        if self.0.is_wide() { self.transfer(set(setting.register & !1, 0), Some(setting)) } else { self.write(setting) }
    }

    /// Writes one setting, or two of a register of two bytes.
    fn transfer(&mut self, first: Setting, second: Option<Setting>) -> Result<(), SensorError<B::Error>> {
        let Some(second) = second else { return self.write(first) };
        let Setting { register, value } = first;
        self.0.write_both(register, [value, second.value]).map_err(|error| SensorError::Bus { register, error })
    }

    fn verify(&mut self, setting: Setting) -> Result<(), SensorError<B::Error>> {
        self.verify_bits(setting, 0xFF)
    }

    fn verify_bits(&mut self, Setting { register, value }: Setting, mask: u8) -> Result<(), SensorError<B::Error>> {
        let found = self.read(register)? & mask;
        let values = RegisterValues { address: self.0.address(), found, expected: value };
        if found == value { Ok(()) } else { Err(SensorError::NotTaken { register, values }) }
    }
}

/// The highest rate with every line of the array, or with the slow clock.
pub(crate) const WHOLE_FPS: u32 = 30;

/// Returns the lines of a frame at a rate, if there are so many of them in 1/30 s.
const fn frame_lines(in_thirtieth: u32, fps: u32) -> u16 {
    ((60 * in_thirtieth + fps) / (2 * fps)) as u16
}

/// Returns the exposure of a table in lines: at most `most`, and `spare` less than the lines of a frame.
const fn usual_exposure(most: u16, lines: u16, spare: u16) -> u16 {
    if lines - spare < most { lines - spare } else { most }
}

/// Returns the milliseconds of six frames.
const fn six_frames(fps: u32) -> u16 {
    (6000 / fps) as u16
}

/// The value of U and V, which the sensors are told to fix: no color.
pub const FIXED_CHROMA: u8 = 0x80;

/// The size of QVGA, 320 × 240.
const QVGA: FrameSize = match FrameSize::new(320, 240) {
    Ok(size) => size,
    Err(_) => panic!("a valid size: decided at compile time"),
};

/// Returns the time from the first of [`QVGA`]'s rows to the last, which come so many clocks of 24 MHz apart.
///
/// A sensor whose clock is divided had a faster one: its rate is checked.
const fn readout(clocks: u16) -> ReadoutTime {
    readout_at(clocks, 24_000)
}

/// Returns that time with another clock, in kHz.
const fn readout_at(clocks: u16, khz: u16) -> ReadoutTime {
    match ReadoutTime::from_ms((QVGA.height() - 1) as f32 * clocks as f32 / khz as f32) {
        Some(time) => time,
        None => panic!("within a second: decided at compile time"),
    }
}

#[cfg(test)]
mod tests;
