//! Plays a clip to the program of a Raspberry Pi Pico 2 in an emulator.
//!
//!     wstac-pico2 ELF FLASH CLIP.raw FRAMES SERIAL [REQUEST] [FRAME:FAULT]…
//!
//! FLASH is a file with what the flash has beside the program, or "-" if it is erased. It is written at the end if it
//! is a file. CLIP.raw has frames of 320 x 240 GREY, of which the first FRAMES are played. What comes out of the serial
//! line goes to the file SERIAL. REQUEST is what the host sends at the start, as hexadecimal bytes or "-". The state at
//! the end is printed as JSON. A FAULT begins at a frame of the clip: see `machine.rs`. "send" with bytes is a request
//! that comes then.

mod dma;
mod flash;
mod machine;
mod sensor;

use std::collections::HashMap;
use std::fs;
use std::process::ExitCode;

use flash::Flash;
use machine::Board;

const SIZE: usize = 320 * 240;
const FLASH: u32 = 0x1000_0000;

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            eprintln!("wstac-pico2: {reason}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &[String]) -> Result<(), String> {
    let [elf, flash, clip, frames, serial, more @ ..] = arguments else {
        return Err("expected ELF FLASH CLIP.raw FRAMES SERIAL [REQUEST] [FRAME:FAULT]…".to_owned());
    };
    let read = |file: &String| fs::read(file).map_err(|error| format!("{file}: {error}"));
    let frames: usize = frames.parse().map_err(|_| "FRAMES is not a number")?;
    let clip: Vec<_> = read(clip)?.chunks_exact(SIZE).take(frames).map(<[u8]>::to_vec).collect();
    let (request, faults) = more.split_first().map_or(("-", &[][..]), |(request, faults)| (request.as_str(), faults));
    let faults = faults.iter().map(|fault| {
        let (frame, fault) = fault.split_once(':').ok_or("a fault is FRAME:FAULT")?;
        if let Some(request) = fault.strip_prefix("send ") {
            bytes(request)?;
        }
        Ok((frame.parse().map_err(|_| "a fault begins with a number")?, fault.to_owned()))
    });
    let faults = faults.collect::<Result<HashMap<_, _>, String>>()?;
    let kept = if std::path::Path::new(flash).exists() { read(flash)? } else { Vec::new() };
    let mut board = Board::new(Flash::new(kept, &image(&read(elf)?)?)?, clip, faults)?;
    if request != "-" {
        board.receive(&bytes(request)?);
    }
    let sent = board.play().to_vec();
    fs::write(serial, sent).map_err(|error| format!("{serial}: {error}"))?;
    if flash != "-" {
        fs::write(flash, board.flash.bytes()).map_err(|error| format!("{flash}: {error}"))?;
    }
    let (uses, floating) = (board.uses(), board.floating());
    let problems = &board.flash.problems;
    let mut lights = board.lights;
    lights.dedup();
    let (resets, instructions) = (board.resets, board.instructions);
    println!(
        "{{\"resets\":{resets},\"uses\":{uses},\"floating\":{floating:?},\"lights\":{lights:?},\
         \"instructions\":{instructions},\"problems\":{problems:?}}}"
    );
    Ok(())
}

/// Returns the bytes of a request of the host.
pub(crate) fn bytes(hexadecimal: &str) -> Result<Vec<u8>, String> {
    let digits = (0..hexadecimal.len()).step_by(2).map(|at| hexadecimal.get(at..at + 2));
    let bytes = digits.map(|digits| u8::from_str_radix(digits?, 16).ok());
    bytes.collect::<Option<_>>().ok_or_else(|| "a request is not in hexadecimal".to_owned())
}

/// Returns what is flashed of a program: its loaded parts, from the beginning of the flash.
fn image(elf: &[u8]) -> Result<Vec<u8>, String> {
    let half = |at: usize| elf.get(at..at + 2).map(|bytes| u16::from_le_bytes([bytes[0], bytes[1]]) as usize);
    let word = |at: usize| {
        let bytes = elf.get(at..at + 4)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?))
    };
    let parts = || {
        let (table, size, count) = (word(28)? as usize, half(42)?, half(44)?);
        let mut image = Vec::new();
        for at in (0..count).map(|number| table + number * size) {
            let (kind, offset, place, length) =
                (word(at)?, word(at + 4)? as usize, word(at + 12)?, word(at + 16)? as usize);
            if kind == 1 && length > 0 {
                let begin = place.checked_sub(FLASH)? as usize;
                image.resize(image.len().max(begin + length), 0xFF);
                image[begin..begin + length].copy_from_slice(elf.get(offset..offset + length)?);
            }
        }
        Some(image)
    };
    parts().ok_or_else(|| "the program is not an ELF file for a flash at 0x10000000".to_owned())
}
