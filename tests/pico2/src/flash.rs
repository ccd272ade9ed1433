//! The flash of a Raspberry Pi Pico 2, a W25Q32JV, and the functions of the boot ROM that erase and program it (RP2350
//! data sheet, 5.4). The ROM itself is addresses at which the core calls these functions.
//!
//! An erasure sets bits, and programming clears them. Each takes its longest time (W25Q32JV data sheet, 9.6). While the
//! flash is not set up to be read as memory, nothing may run from there, and no interrupt may come.

use rp2350_emu::CortexM33;
use rp2350_emu::core::bus_trait::CoreBus;

const SIZE: usize = 0x40_0000;
const SECTOR: usize = 4096;
const PAGE: usize = 256;
const ERASE_MILLISECONDS: u64 = 400;
const PROGRAM_MILLISECONDS: u64 = 3;
const FLASH: u32 = 0x1000_0000;
const RAM: u32 = 0x2000_0000;
/// The end of the ROM.
const ROM_END: u32 = 0x8000;
/// The addresses of the function that looks others up (5.4.1), and of the first of those.
const LOOKUP: u32 = 0x100;
const FIRST: u32 = 0x200;
const NAMES: [&[u8; 2]; 6] = [b"IF", b"EX", b"RE", b"RP", b"FC", b"CX"];
/// The flag of functions for Arm in secure mode.
const ARM_SECURE: u32 = 4;

/// The boot RAM's address. The ROM leaves the function there that lets the flash be read as memory again (5.4.8.16).
pub(crate) const BOOT_RAM: u32 = 0x400E_0000;
/// The memory interface.
pub(crate) const QMI: u32 = 0x400D_0000;
/// LDR r0, [pc, #4]; STR r0, [r0]; BX lr; and the address of a register of the memory interface.
const SETS_UP: [u32; 3] = [0x6000_4801, 0xBF00_4770, QMI];

/// The mode of the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FlashMode {
    Memory,
    Connected,
    Serial,
    Flushed,
}

pub(crate) struct Flash {
    bytes: Vec<u8>,
    step: FlashMode,
    /// Whether bytes have changed since the emulator has taken them.
    has_changed: bool,
    pub(crate) problems: Vec<String>,
}

/// Returns the ROM: its version, and a pointer to the function that looks others up.
pub(crate) fn rom() -> Vec<u8> {
    let mut rom = vec![0; ROM_END as usize];
    rom[0x13] = 2;
    rom[0x16..0x18].copy_from_slice(&((LOOKUP | 1) as u16).to_le_bytes());
    rom
}

/// Returns a word of the boot RAM.
pub(crate) fn boot_ram(offset: u32) -> u32 {
    SETS_UP.get(offset as usize / 4).copied().unwrap_or(0)
}

impl Flash {
    /// Creates a flash with this content, and a program at its beginning.
    pub(crate) fn new(mut bytes: Vec<u8>, program: &[u8]) -> Result<Self, String> {
        bytes.resize(SIZE, 0xFF);
        bytes.get_mut(..program.len()).ok_or("the program is longer than the flash")?.copy_from_slice(program);
        Ok(Self { bytes, step: FlashMode::Memory, has_changed: false, problems: Vec::new() })
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    fn check(&mut self, is_right: bool, problem: &str) {
        if !is_right && !self.problems.iter().any(|known| known == problem) {
            self.problems.push(problem.to_owned());
        }
    }

    /// Lets the flash be read again: the memory interface is set up.
    pub(crate) fn set_up(&mut self) {
        self.check(self.step == FlashMode::Flushed, "the flash is set up before the cache is flushed");
        self.step = FlashMode::Memory;
    }

    /// Is called before an instruction. Returns the milliseconds that it takes if it is a function of the ROM, which is
    /// then done.
    pub(crate) fn calls(&mut self, core: &mut CortexM33, bus: &mut impl CoreBus) -> Option<u64> {
        let at = core.reg(15);
        if (FLASH..RAM).contains(&at) {
            self.check(self.step == FlashMode::Memory, "the program goes on in the flash while that is written");
        }
        if at >= ROM_END {
            return None;
        }
        let [first, second, third] = [0, 1, 2].map(|register| core.reg(register));
        let mut milliseconds = 0;
        if at == LOOKUP {
            let found = NAMES.iter().position(|name| u32::from(u16::from_le_bytes(**name)) == first);
            self.check(found.is_some() && second == ARM_SECURE, "the boot ROM is asked for another function");
            core.set_reg(0, found.map_or(0, |number| (FIRST + 4 * number as u32) | 1));
        } else {
            let number = at.checked_sub(FIRST).map(|offset| offset as usize / 4);
            match number.and_then(|number| NAMES.get(number)).copied() {
                Some(b"IF") => {
                    self.check(core.regs.primask == 1, "interrupts are on while the flash is written");
                    self.step = FlashMode::Connected;
                }
                Some(b"EX") => {
                    self.check(self.step == FlashMode::Connected, "the flash leaves reading without being connected");
                    self.step = FlashMode::Serial;
                }
                Some(b"RE") => milliseconds = self.erase(first as usize, second as usize),
                Some(b"RP") => {
                    let data: Vec<_> = (second..second.saturating_add(third)).map(|at| bus.read8(at, 0)).collect();
                    self.check(second >= RAM, "what is programmed is not in RAM");
                    milliseconds = self.program(first as usize, &data);
                }
                Some(b"FC") => {
                    self.check(self.step == FlashMode::Serial, "the cache is flushed at another time");
                    self.step = FlashMode::Flushed;
                }
                Some(b"CX") => self.set_up(),
                _ => self.check(false, "the program runs in the boot ROM"),
            }
        }
        core.set_reg(15, core.reg(14) & !1);
        Some(milliseconds)
    }

    fn erase(&mut self, from: usize, count: usize) -> u64 {
        let is_whole = from.is_multiple_of(SECTOR) && count.is_multiple_of(SECTOR) && from + count <= SIZE;
        self.check(is_whole && self.step == FlashMode::Serial, "an erasure of parts of sectors, or at another time");
        if is_whole {
            self.bytes[from..from + count].fill(0xFF);
            self.has_changed = true;
        }
        ERASE_MILLISECONDS * (count / SECTOR) as u64
    }

    fn program(&mut self, to: usize, data: &[u8]) -> u64 {
        let is_whole = to.is_multiple_of(PAGE) && data.len().is_multiple_of(PAGE) && to + data.len() <= SIZE;
        self.check(is_whole && self.step == FlashMode::Serial, "parts of pages are programmed, or at another time");
        if is_whole {
            for (byte, new) in self.bytes[to..].iter_mut().zip(data) {
                *byte &= new;
            }
            self.has_changed = true;
        }
        PROGRAM_MILLISECONDS * (data.len() / PAGE) as u64
    }

    /// Returns the content if it has changed since the last call.
    pub(crate) fn changed(&mut self) -> Option<&[u8]> {
        std::mem::take(&mut self.has_changed).then_some(self.bytes.as_slice())
    }
}
