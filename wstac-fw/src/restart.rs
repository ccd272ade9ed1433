//! A new start of the chip.

#[cfg(not(feature = "rp"))]
pub(crate) fn restart() -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}

/// Restarts the chip. A reset by the core alone would leave the peripherals as they are. The watchdog resets nothing
/// before it has been told what: what embassy tells it.
#[cfg(feature = "rp")]
pub(crate) fn restart() -> ! {
    embassy_rp::pac::PSM.wdsel().write_value(embassy_rp::pac::psm::regs::Wdsel(0x0001_FFFC));
    embassy_rp::pac::WATCHDOG.ctrl().write(|w| w.set_trigger(true));
    loop {
        cortex_m::asm::nop();
    }
}
