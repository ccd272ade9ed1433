//! The start of an STM32H743 or H747: its clocks, whatever a bootloader has left.

#[cfg(feature = "h747")]
use core::mem::MaybeUninit;

use cortex_m::peripheral::{MPU, NVIC};
#[cfg(feature = "h747")]
use embassy_stm32::SharedData;
use embassy_stm32::pac::gpio::vals::Moder;
use embassy_stm32::pac::{GPIOH, PWR, RCC, SYSCFG};
use embassy_stm32::rcc::{
    APBPrescaler, HSIPrescaler, Hse, HseMode, Hsi48Config, Pll, PllDiv, PllMul, PllPreDiv, PllSource, Sysclk,
    VoltageScale, mux,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peripherals};

use super::MHZ;

// Runs before anything else: the AXI SRAM, which has the DMA's ring and an STM32H743's crash record, takes one read at
// a time (READ_ISS_OVERRIDE of the interconnect's target 7). A chip of revision Y returns wrong data otherwise when
// several are under way (ES0392, 2.2.9); newer ones have no need of it, and lose nothing that this program uses. Rust
// may not run yet.
core::arch::global_asm!(
    ".pushsection .text.__pre_init, \"ax\"",
    ".global __pre_init",
    ".type __pre_init, %function",
    ".thumb_func",
    "__pre_init:",
    "movw r0, #0x8108",
    "movt r0, #0x5100",
    "movs r1, #1",
    "str r1, [r0]",
    "dsb",
    "bx lr",
    ".size __pre_init, . - __pre_init",
    ".popsection",
);

/// The cycles between two looks at the board's clock, and their number: a quarter of a second at 64 MHz.
const HSE_CYCLES: u32 = 6400;
const HSE_LOOKS: u32 = 2500;
/// The memories without copies in the core, and their sizes: the AXI SRAM, and the sectors of the settings
/// and models (`flash.rs`). A size is a power of two, and the start a multiple of it.
const UNCACHED: &[(u32, u32)] = &[
    (0x2400_0000, 0x8_0000),
    (0x0818_0000, 0x4_0000),
    // The crash record (`build/link.rs`).
    #[cfg(feature = "h747")]
    (0x3800_0000, 0x1_0000),
    #[cfg(feature = "models")]
    (0x0810_0000, 0x8_0000),
];
/// The frequency of the PLL's oscillator.
const VCO: u32 = 576_000_000;

/// The board's clock, and the factors that make 576 MHz of it.
#[derive(Clone, Copy)]
pub struct Crystal {
    hertz: u32,
    mode: HseMode,
    divide: PllPreDiv,
    multiply: PllMul,
    has_switch: bool,
}

impl Crystal {
    /// Creates a clock of this frequency: a crystal ([`HseMode::Oscillator`]), or a clock that another chip drives
    /// ([`HseMode::Bypass`]). It is divided and multiplied.
    ///
    /// # Panics
    /// Panics if the PLL gets less than 2 MHz or more than 16 MHz, or does not make 576 MHz within 0.5 %.
    pub const fn new(hertz: u32, mode: HseMode, divide: u8, multiply: u16) -> Self {
        let reference = hertz / divide as u32;
        assert!(reference >= 2_000_000 && reference <= 16_000_000, "the PLL needs 2 to 16 MHz");
        assert!((reference * multiply as u32).abs_diff(VCO) <= VCO / 200, "the PLL must make 576 MHz within 0.5 %");
        let (divide, multiply) = (PllPreDiv::from_bits(divide), PllMul::from_bits(multiply - 1));
        Self { hertz, mode, divide, multiply, has_switch: false }
    }

    /// Returns a clock that runs only while PH1 is high.
    #[must_use]
    pub const fn switched_by_ph1(self) -> Self {
        Self { has_switch: true, ..self }
    }
}

/// Starts the chip, and the clock of its USB if that is used. Returns its peripherals, and whether the board's clock
/// runs; if not, the chip's own is used.
pub fn start(crystal: Crystal, has_usb: bool) -> (Peripherals, bool) {
    take_over();
    if crystal.has_switch {
        RCC.ahb4enr().modify(|w| w.set_gpiohen(true));
        // The clock is there two cycles of the bus later.
        let _ = RCC.ahb4enr().read();
        GPIOH.bsrr().write(|w| w.set_bs(1, true));
        GPIOH.moder().modify(|w| w.set_moder(1, Moder::OUTPUT));
    }
    let has_crystal = has_hse(crystal.mode);
    let config = clocks(has_crystal.then_some(crystal), has_usb);
    #[cfg(feature = "h743")]
    let peripherals = embassy_stm32::init(config);
    #[cfg(feature = "h747")]
    let peripherals = {
        /// For the other core, which stays off.
        static SHARED: MaybeUninit<SharedData> = MaybeUninit::uninit();
        embassy_stm32::init_primary(config, &SHARED)
    };
    enable_caches();
    (peripherals, has_crystal)
}

/// Lets the core keep copies of what it reads of the program, which nothing writes. It keeps none of what others write:
/// the AXI SRAM with the DMA's ring, the crash record, and the sectors of the settings.
fn enable_caches() {
    // SAFETY: nobody else uses these parts of the core.
    #[allow(unsafe_code)]
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    for (number, (base, bytes)) in (0..).zip(UNCACHED.iter().copied()) {
        // Normal memory without a cache, for reading and writing, not for instructions (ARMv7-M, B3.5.9).
        let (no_instructions, full_access, uncached) = (1 << 28, 0b011 << 24, 0b001 << 19);
        let size = (bytes.trailing_zeros() - 1) << 1;
        // SAFETY: the regions have no code in them, and everything else stays as it is.
        #[allow(unsafe_code)]
        unsafe {
            core.MPU.rnr.write(number);
            core.MPU.rbar.write(base);
            core.MPU.rasr.write(no_instructions | full_access | uncached | size | 1);
        }
    }
    // SAFETY: other memory is as it was (bit 2). The regions hold in handlers of faults, too (bit 1), where the crash
    // record is written.
    #[allow(unsafe_code)]
    unsafe {
        core.MPU.ctrl.write(1 << 2 | 1 << 1 | 1);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    core.SCB.enable_icache();
    core.SCB.enable_dcache(&mut core.CPUID);
}

/// Leaves the state of a bootloader: its copies of memory, its clock and supply, its interrupts, its memory protection.
/// After a reset without one, nothing of this changes anything.
///
/// The supply may be lowered only after the clock, and its highest range ends by a switch of its own (RM0433, 6.6.2).
fn take_over() {
    // SAFETY: nobody else uses these parts of the core.
    #[allow(unsafe_code)]
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    core.SCB.disable_dcache(&mut core.CPUID);
    RCC.cr().modify(|w| w.set_hsion(true));
    while !RCC.cr().read().hsirdy() {}
    RCC.cfgr().modify(|w| w.set_sw(Sysclk::HSI));
    while RCC.cfgr().read().sws() != Sysclk::HSI {}
    RCC.cr().modify(|w| {
        for pll in 0..3 {
            w.set_pllon(pll, false);
        }
        w.set_hseon(false);
    });
    while RCC.cr().read().hserdy() {}
    RCC.apb4enr().modify(|w| w.set_syscfgen(true));
    SYSCFG.pwrcr().modify(|w| w.set_oden(0));
    while !PWR.d3cr().read().vosrdy() {}
    // SAFETY: interrupts that nobody has enabled yet are disabled, and no memory is protected: as after a reset.
    #[allow(unsafe_code)]
    unsafe {
        for (clear_enable, clear_pending) in (*NVIC::PTR).icer.iter().zip(&(*NVIC::PTR).icpr) {
            clear_enable.write(u32::MAX);
            clear_pending.write(u32::MAX);
        }
        // A region of the bootloader would hold again, and above this program's, once these are enabled.
        (*MPU::PTR).ctrl.write(0);
        for region in 0..((*MPU::PTR)._type.read() >> 8 & 0xFF) {
            (*MPU::PTR).rnr.write(region);
            (*MPU::PTR).rasr.write(0);
        }
        cortex_m::interrupt::enable();
    }
}

/// Switches the board's clock on and returns whether it runs.
fn has_hse(mode: HseMode) -> bool {
    RCC.cr().modify(|w| w.set_hsebyp(mode != HseMode::Oscillator));
    RCC.cr().modify(|w| w.set_hseon(true));
    (0..HSE_LOOKS).any(|_| {
        cortex_m::asm::delay(HSE_CYCLES);
        RCC.cr().read().hserdy()
    })
}

/// Returns the clock configuration: 72 or 96 MHz from the board's clock or the chip's 64 MHz, and 24 MHz for the
/// sensor.
///
/// The supply range is VOS3, the lowest to run in, up to 100 MHz of the buses. An STM32H747's regulator is the linear
/// one (`SupplyConfig::LDO`, embassy's default), which its boards have to have.
///
/// The camera interface needs 2.5 times the pixel clock of 24 MHz, which is 60 MHz; 72 MHz leaves it some. The PLL's
/// range for a reference of more than 2 MHz begins at 192 MHz; 576 MHz gives 72, 96 and 24 MHz.
fn clocks(crystal: Option<Crystal>, has_usb: bool) -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    // USB needs 48 MHz within 0.25 %: the chip's oscillator, which follows the host's frames.
    rcc.hsi48 = has_usb.then_some(Hsi48Config { sync_from_usb: true });
    if has_usb {
        rcc.mux.usbsel = mux::Usbsel::HSI48;
    }
    let (source, prediv, mul) = if let Some(Crystal { hertz, mode, divide, multiply, .. }) = crystal {
        rcc.hsi = None;
        rcc.hse = Some(Hse { freq: Hertz(hertz), mode });
        (PllSource::HSE, divide, multiply)
    } else {
        rcc.hsi = Some(HSIPrescaler::DIV1);
        (PllSource::HSI, PllPreDiv::DIV8, PllMul::MUL72)
    };
    let divp = Some(if MHZ == 72 { PllDiv::DIV8 } else { PllDiv::DIV6 });
    let divq = Some(PllDiv::DIV24);
    rcc.pll1 = Some(Pll {
        source,
        prediv,
        mul,
        #[cfg(feature = "h743")]
        fracn: None,
        divp,
        divq,
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.apb1_pre = APBPrescaler::DIV2;
    rcc.apb2_pre = APBPrescaler::DIV2;
    rcc.apb3_pre = APBPrescaler::DIV2;
    rcc.apb4_pre = APBPrescaler::DIV2;
    rcc.voltage_scale = VoltageScale::Scale3;
    config
}
