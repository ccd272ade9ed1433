//! Measures natural logarithms of the same integers with every kernel, in units of 2^-26.

use wstac_core::ln::fixed::Fixed;
use wstac_core::ln::libm::Libm;
use wstac_core::ln::micromath::Micromath;
use wstac_core::ln::{LN_FRACTION_BITS, Ln};
use wstac_fw::emulated::clock::Clock;
use wstac_fw::emulated::host::File;

/// The number of integers per block. It is small because a board has little RAM.
const BLOCK: usize = 256;
/// The number of blocks.
const BLOCKS: u32 = 16;

type Numbers = [u32; BLOCK];
type Logs = [i32; BLOCK];

unsafe extern "C" {
    /// Computes logarithms with newlib's `logf`.
    fn peer_logf(numbers: *const u32, logs: *mut i32, count: u32);
    /// Computes logarithms with CMSIS-DSP's vector functions. Returns 0 if they are not linked.
    fn peer_vlog_f32(numbers: *const u32, logs: *mut i32, count: u32) -> u32;
    fn peer_vlog_q31(numbers: *const u32, logs: *mut i32, count: u32) -> u32;
}

#[inline(never)]
fn ours<L: Ln>(numbers: &Numbers, logs: &mut Logs) -> u32 {
    let kernel = L::default();
    for (log, &number) in logs.iter_mut().zip(numbers) {
        *log = kernel.ln(number);
    }
    1
}

#[inline(never)]
fn libm_logf(numbers: &Numbers, logs: &mut Logs) -> u32 {
    for (log, &number) in logs.iter_mut().zip(numbers) {
        *log = (libm::logf(number as f32) * (1 << LN_FRACTION_BITS) as f32 + 0.5) as i32;
    }
    1
}

fn newlib_logf(numbers: &Numbers, logs: &mut Logs) -> u32 {
    // SAFETY: the peer reads and writes within the arrays.
    unsafe { peer_logf(numbers.as_ptr(), logs.as_mut_ptr(), BLOCK as u32) };
    1
}

fn vlog_f32(numbers: &Numbers, logs: &mut Logs) -> u32 {
    // SAFETY: as above.
    unsafe { peer_vlog_f32(numbers.as_ptr(), logs.as_mut_ptr(), BLOCK as u32) }
}

fn vlog_q31(numbers: &Numbers, logs: &mut Logs) -> u32 {
    // SAFETY: as above.
    unsafe { peer_vlog_q31(numbers.as_ptr(), logs.as_mut_ptr(), BLOCK as u32) }
}

type Kernel = fn(&Numbers, &mut Logs) -> u32;
const KERNELS: [(&str, Kernel); 8] = [
    ("fixed, 256 segments", ours::<Fixed<256>>),
    ("fixed, 32 segments", ours::<Fixed<32>>),
    ("micromath", ours::<Micromath>),
    ("libm, 64-bit log", ours::<Libm>),
    ("libm, 32-bit logf", libm_logf),
    ("newlib, logf", newlib_logf),
    ("CMSIS-DSP, arm_vlog_f32", vlog_f32),
    ("CMSIS-DSP, arm_vlog_q31", vlog_q31),
];

/// Measures every kernel. Writes the integers and then each kernel's logarithms to the file `ln`.
pub fn measure(clock: &Clock) {
    let file = File::create(b"ln\0");
    let mut logs = [0; BLOCK];
    (0..BLOCKS).for_each(|block| write(&file, &numbers(block).map(u32::cast_signed)));
    for (name, kernel) in KERNELS {
        let mut all = 0;
        for block in 0..BLOCKS {
            let numbers = numbers(block);
            let (ticks, there) = clock.ticks(|| kernel(&numbers, &mut logs));
            all += u64::from(ticks);
            write(&file, &logs);
            all *= u64::from(there);
        }
        crate::say("ln", name, clock.instructions(all) as f64 / f64::from(BLOCKS * BLOCK as u32));
    }
}

/// Returns integers below 2^31. Each length in bits is equally likely.
fn numbers(block: u32) -> Numbers {
    let mut seed = block;
    [(); BLOCK].map(|()| {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let bits = ((seed >> 8) * 31) >> 24;
        1 << bits | (seed.wrapping_mul(0x9E37_79B9) >> 1) & ((1 << bits) - 1)
    })
}

fn write(file: &File, words: &Logs) {
    for word in words {
        file.write(&[*word as i16, (*word >> 16) as i16]);
    }
}
