#![no_std]
#![no_main]
use defmt_rtt as _;
use embassy_executor::Spawner;
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! { loop {} }
#[embassy_executor::main]
async fn main(_s: Spawner) {
    let _p = embassy_stm32::init(embassy_stm32::Config::default());
    defmt::info!("hi");
}
