//! The STM32U575: its clocks, and the peripherals that its boards use.

#[cfg(feature = "settings")]
pub(super) mod flash;

pub(super) use embassy_stm32::interrupt::typelevel::USART1 as UsartInterrupt;
pub(super) use embassy_stm32::pac::USART1 as USART;
use embassy_stm32::pac::pwr::vals::Regsel;
use embassy_stm32::pac::rcc::vals::Lsedrv;
use embassy_stm32::pac::{DBGMCU, FLASH, ICACHE, PWR, RCC};
pub use embassy_stm32::peripherals::{IWDG as WatchdogPart, MCO as ClockOutput, USART1 as Usart};
use embassy_stm32::rcc::{
    LsConfig, LseConfig, LseDrive, LseMode, MSIRange, McoSource, MsiAutoCalibration, Pll, PllDiv, PllMul, PllPreDiv,
    PllSource, Sysclk, VoltageScale,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peripherals};

use crate::node::Thermometer;
use crate::setup;

/// The core's clock: 72, which takes the pixels of every sensor, or 24 on less power.
pub(super) const MHZ: u32 = setup::MHZ;
/// The clock of 24 MHz for the sensor.
pub(super) const SENSOR_CLOCK: McoSource = McoSource::MSIS;
/// The supply range, the lowest for the core's clock: 4 up to 24 MHz, 2 up to 110 MHz.
const RANGE: VoltageScale = if MHZ == 24 { VoltageScale::RANGE4 } else { VoltageScale::RANGE2 };

/// The cycles between two looks at the crystal, and their number: 2 seconds at 4 MHz, which it may take.
const LSE_CYCLES: u32 = 4000;
const LSE_LOOKS: u32 = 2000;
/// The looks at the regulator that switches, one each 10 µs: 1 ms, of which it takes a small part.
const SMPS_LOOKS: u32 = 100;

/// Starts the chip. Returns its peripherals, and whether the board's crystal of 32,768 Hz corrects its clock.
pub fn start() -> (Peripherals, bool) {
    let has_crystal = has_lse();
    // In range 4, 24 MHz need a wait state, and `init` raises the clock first.
    FLASH.acr().modify(|w| w.set_latency(1));
    let peripherals = embassy_stm32::init(clocks(has_crystal));
    switch_regulator();
    ICACHE.cr().modify(|w| w.set_en(true));
    (peripherals, has_crystal)
}

/// Takes the regulator that switches, which needs half of the current of the linear one. Some packages have none.
fn switch_regulator() {
    PWR.cr3().modify(|w| w.set_regsel(Regsel::SMPS));
    let is_switched = (0..SMPS_LOOKS).any(|_| {
        cortex_m::asm::delay(10 * MHZ);
        PWR.svmsr().read().regs() == Regsel::SMPS
    });
    if !is_switched {
        PWR.cr3().modify(|w| w.set_regsel(Regsel::LDO));
    }
}

/// Switches the crystal on, and returns whether it runs.
fn has_lse() -> bool {
    RCC.ahb3enr().modify(|w| w.set_pwren(true));
    PWR.dbpcr().modify(|w| w.set_dbp(true));
    RCC.bdcr().modify(|w| {
        w.set_lsedrv(Lsedrv::MEDIUM_HIGH);
        w.set_lseon(true);
    });
    (0..LSE_LOOKS).any(|_| {
        cortex_m::asm::delay(LSE_CYCLES);
        let state = RCC.bdcr().read();
        if state.lserdy() && !state.lsesysen() {
            // The clock's correction needs it. It may be set only for a crystal that runs.
            RCC.bdcr().modify(|w| w.set_lsesysen(true));
        }
        state.lserdy() && state.lsesysrdy()
    })
}

/// Returns the clock configuration: 24 MHz of the chip's oscillator for the sensor, and the same or 72 MHz for the
/// core.
///
/// The camera interface needs 2.5 times the pixel clock, which is 6 MHz of an HM01B0.
fn clocks(has_crystal: bool) -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hsi48 = None;
    rcc.msik = None;
    rcc.msis = Some(MSIRange::RANGE_24MHZ);
    rcc.ls = LsConfig::off();
    if has_crystal {
        let mode = LseMode::Oscillator(LseDrive::MediumHigh);
        rcc.ls.lse = Some(LseConfig { frequency: Hertz(32_768), mode, peripherals_clocked: true });
        rcc.auto_calibration = MsiAutoCalibration::MSIS;
    }
    rcc.voltage_range = RANGE;
    if MHZ != 24 {
        let (source, prediv, mul) = (PllSource::MSIS, PllPreDiv::DIV2, PllMul::MUL12);
        rcc.pll1 = Some(Pll { source, prediv, mul, divp: None, divq: None, divr: Some(PllDiv::DIV2) });
        rcc.sys = Sysclk::PLL1_R;
    }
    config
}

/// Lets the watchdog wait while a debugger halts the core.
pub(super) fn stop_watchdog_in_debugger() {
    DBGMCU.apb1lfzr().modify(|w| w.set_dbg_iwdg_stop(true));
}

/// Returns whether the watchdog has caused this start, and forgets it.
pub(super) fn take_hung() -> bool {
    let hung = RCC.csr().read().iwdgrstf();
    RCC.csr().modify(|w| w.set_rmvf(true));
    hung
}

/// Not read: the board reports no temperature.
pub(super) type ChipThermometer = ();

pub(super) fn thermometer() {}

impl Thermometer for () {
    fn tenths(&mut self) -> Option<i16> {
        None
    }
}
