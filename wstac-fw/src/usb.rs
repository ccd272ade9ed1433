//! USB as the serial line: one CDC-ACM port, which every system knows without a driver.
//!
//! What is written while no host has opened the port (DTR) is discarded, as on a wire without a reader. A host that
//! opens it late gets the description. One that stops reading fills the queue, and messages without room are left out.
//! A port that is closed and opened before this task has a turn counts as open all the time: its host has to ask.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use embassy_futures::join::join3;
use embassy_futures::select::select;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant, Timer};
use embassy_usb::class::cdc_acm::{CdcAcmClass, ControlChanged, Receiver, Sender, State, USB_CLASS_CDC};
use embassy_usb::driver::Driver;
use embassy_usb::{Builder, Config};

use crate::link::EnterBootloader;
use crate::node::CHANGED;
use crate::serial::{self, Peripheral};

/// The bytes of a packet of full speed.
const PACKET: usize = 64;
/// The time between two looks at a queue without room for a packet.
const FULL: Duration = Duration::from_millis(1);
/// The time between two looks at the number of the bus's frame, and the longest one for which a frame that is new at
/// the second look still counts as young. A frame has 1 ms, and its last fifth is to be avoided.
const LOOK: Duration = Duration::from_micros(100);
const YOUNG: Duration = Duration::from_micros(600);
/// The looks after which a packet is sent all the same: the bus sleeps.
const LOOKS: u32 = 30;

/// How often a host has opened and closed the port: it is open if this is odd.
static CHANGES: AtomicU32 = AtomicU32::new(0);
/// Whether a packet that left the queue waits for the host.
static IS_HELD: AtomicBool = AtomicBool::new(false);
/// The signal that the queue has bytes.
static WRITTEN: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// The device that a board is.
pub(crate) struct Device {
    /// The numbers of vendor and product.
    pub numbers: [u16; 2],
    /// The chip's number, so that a host with two boards knows which is which. It may be empty.
    pub serial: &'static str,
    /// Returns the number of the bus's frame if packets have to be sent early in a frame.
    pub frame: Option<fn() -> u16>,
}

struct Buffers {
    state: State<'static>,
    configuration: [u8; PACKET],
    bos: [u8; 16],
    control: [u8; PACKET],
}

/// Returns the peripheral of a board with this boot loader.
pub(crate) const fn peripheral(bootloader: Option<EnterBootloader>) -> Peripheral {
    Peripheral {
        begin: || if opened().is_some() { WRITTEN.signal(()) } else { serial::discard() },
        opened,
        is_sent: || !IS_HELD.load(Ordering::Relaxed),
        bootloader,
    }
}

fn opened() -> Option<u32> {
    let changes = CHANGES.load(Ordering::Relaxed);
    (changes % 2 == 1).then_some(changes)
}

/// Notes that the port was opened or closed. Only this task does, so nothing comes between.
fn change() {
    CHANGES.store(CHANGES.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
}

/// Serves a host for ever as this device.
///
/// # Panics
/// Panics at a second call.
pub(crate) async fn run(driver: impl Driver<'static>, device: Device) -> ! {
    let new = Buffers { state: State::new(), configuration: [0; PACKET], bos: [0; 16], control: [0; PACKET] };
    let Some(buffers) = cortex_m::singleton!(: Buffers = new) else { panic!("USB is started once") };
    let Buffers { state, configuration, bos, control } = buffers;
    let Device { numbers: [vendor, product], serial, frame } = device;
    let mut config = Config::new(vendor, product);
    (config.manufacturer, config.product) = (Some("WSTac"), Some("WSTac tactile sensor"));
    config.serial_number = (!serial.is_empty()).then_some(serial);
    (config.composite_with_iads, config.max_power) = (false, 250);
    (config.device_class, config.device_sub_class, config.device_protocol) = (USB_CLASS_CDC, 0, 0);
    let mut builder = Builder::new(driver, config, configuration, bos, &mut [], control);
    let class = CdcAcmClass::new(&mut builder, state, PACKET as u16);
    let mut device = builder.build();
    let (mut sender, receiver, control) = class.split_with_control();
    join3(device.run(), serve(&mut sender, &control, frame), receive(receiver)).await.0
}

/// Sends while a host has the port open.
async fn serve<D: Driver<'static>>(
    sender: &mut Sender<'static, D>,
    control: &ControlChanged<'static>,
    frame: Option<fn() -> u16>,
) -> ! {
    loop {
        until(control, true).await;
        serial::discard();
        change();
        // The board says what it is.
        CHANGED.signal(());
        select(until(control, false), send(sender, frame)).await;
        change();
        IS_HELD.store(false, Ordering::Relaxed);
    }
}

async fn until(control: &ControlChanged<'static>, is_open: bool) {
    while control.dtr() != is_open {
        control.control_changed().await;
    }
}

/// Waits until a frame of the bus is young. A packet that its buffer has no room for comes later.
async fn young_frame(number: fn() -> u16) {
    let (mut before, mut at) = (number(), Instant::now());
    for _ in 0..LOOKS {
        Timer::after(LOOK).await;
        let (found, now) = (number(), Instant::now());
        if found != before && now - at < YOUNG {
            break;
        }
        (before, at) = (found, now);
    }
}

async fn send<D: Driver<'static>>(sender: &mut Sender<'static, D>, frame: Option<fn() -> u16>) -> ! {
    let mut packet = [0; PACKET];
    let mut was_full = false;
    loop {
        let mut count = 0;
        for (place, byte) in packet.iter_mut().zip(core::iter::from_fn(serial::next)) {
            *place = byte;
            count += 1;
        }
        IS_HELD.store(count > 0, Ordering::Relaxed);
        // A host takes bytes at the end of a transfer: after a full packet, that is a shorter one, of 0 bytes if there
        // are none.
        if count == 0 && !was_full {
            WRITTEN.wait().await;
            continue;
        }
        if let Some(frame) = frame {
            young_frame(frame).await;
        }
        if sender.write_packet(packet.get(..count).unwrap_or_default()).await.is_ok() {
            was_full = count == PACKET;
        } else {
            sender.wait_connection().await;
        }
    }
}

/// Takes requests. A host that sends more than there is room for has to wait.
async fn receive<D: Driver<'static>>(mut receiver: Receiver<'static, D>) -> ! {
    let mut packet = [0; PACKET];
    receiver.wait_connection().await;
    loop {
        while !serial::takes(PACKET) {
            Timer::after(FULL).await;
        }
        match receiver.read_packet(&mut packet).await {
            Ok(count) => packet.iter().take(count).copied().for_each(serial::arrived),
            Err(_) => receiver.wait_connection().await,
        }
    }
}
