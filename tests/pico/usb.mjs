// A computer at the USB of a Raspberry Pi Pico: it enumerates a CDC-ACM device as Linux does, and a program opens its port
// (USB 2.0, 9.1 and 9.4; CDC PSTN 1.2, 6.3). The emulator's own host requests the state of the lines of the device instead of
// the interface, and takes bytes that nobody reads.

// Times after the device is there: until the reset ends, from there to the first request, and until a program opens the port.
const RESET = 50e6, RECOVERY = 10e6, OPENS = 100e6;
// A frame of the bus, and its last fifth, of which the chip does not recover from some errors (RP2040-E15). A packet
// that has waited for its host may come then.
const FRAME = 1e6, LATE = 0.8 * FRAME, WAITED = 1e5;
// Of the controller (RP2040 data sheet, 4.1.4): the pull-up, a buffer that is available, and its data toggle.
const PULL_UP = 1 << 16, AVAILABLE = 1 << 10, TOGGLE = 1 << 13, BUFFERS = 0x80, LAST = 0xfc;
const ADDRESS = 7, PACKET = 64, DEVICE = 1, CONFIGURATION = 2, STRING = 3, ENGLISH = 0x409;

const setup = (type, request, value, index, length) =>
  Uint8Array.from([type, request, ...[value, index, length].flatMap((word) => [word & 0xff, word >> 8])]);

export class UsbHost {
  constructor() {
    this.problems = new Set();
    this.times = { reset: 0, opened: 0 };
    this.isReading = true;
    this.opens = true;
  }

  /** Connects the device of a chip that starts. `take` takes the bytes that arrive. */
  connect(mcu, take) {
    const { usbCtrl: usb, clock } = mcu;
    Object.assign(this, { usb, clock, take, isOpen: false, isConfigured: false, held: null, waits: false, toggle: 0 });
    this.outgoing = [];
    this.takenAt = 0;
    Object.defineProperty(usb, 'sofFrameNumber', { get: () => Math.floor(clock.nanos / FRAME), set() {} });
    usb.onUSBEnabled = () => this.plug();
    usb.onEndpointWrite = (endpoint, bytes) => this.arrived(endpoint, bytes);
    usb.onResetReceived = () => this.after(RECOVERY, () => this.enumerate());
    const update = usb.DPRAMUpdated.bind(usb);
    usb.DPRAMUpdated = (offset, value) => {
      if (!(value & AVAILABLE) || offset < BUFFERS || offset > LAST) return update(offset, value);
      // A buffer is empty until something arrives.
      if (offset & 4) return this.wanted((offset - 4 - BUFFERS) / 8);
      // A packet stays in its buffer until somebody reads.
      if (!this.isConfigured || offset - BUFFERS !== 8 * this.ends[1]) return update(offset, value);
      if (clock.nanos % FRAME > LATE && clock.nanos - this.takenAt > WAITED) {
        this.problems.add('a packet is sent in the last fifth of a frame of the bus');
      }
      this.held = () => {
        this.held = null;
        this.takenAt = clock.nanos;
        if (((value & TOGGLE) !== 0) !== (this.toggle === 1)) this.problems.add('a packet has the wrong data toggle');
        this.toggle ^= 1;
        update(offset, value);
      };
      if (this.isOpen && this.isReading) this.held();
    };
  }

  after(nanos, then) {
    this.clock.createAlarm(then).schedule(nanos);
  }

  /** Waits for a device, which shows itself by its pull-up, and resets it. */
  plug() {
    this.after(RESET, () => {
      if (!(this.usb.sieCtrl & PULL_UP)) return this.plug();
      Object.assign(this, { isConfigured: false, isOpen: false, held: null });
      this.times.reset += 1;
      this.usb.resetDevice();
    });
  }

  /** Sends a request with these bytes, or asks for some, and calls `then` with those that come back. */
  request(packet, then, bytes = null) {
    this.control = { left: bytes, got: [], length: packet[0] & 0x80 ? packet[6] | (packet[7] << 8) : 0, then };
    this.usb.sendSetupPacket(packet);
  }

  enumerate() {
    const describe = (kind, length, then, index = 0) => {
      this.request(setup(0x80, 6, (kind << 8) | index, kind === STRING ? ENGLISH : 0, length), then);
    };
    this.request(setup(0, 5, ADDRESS, 0, 0), () =>
      describe(DEVICE, 18, (device) => {
        this.device = device;
        describe(CONFIGURATION, 9, (head) =>
          describe(CONFIGURATION, head[2] | (head[3] << 8), (all) => {
            this.configuration = all;
            this.ends = bulk(all);
            this.request(setup(0, 9, 1, 0, 0), () => {
              Object.assign(this, { isConfigured: true, toggle: 0 });
              // Its last string is the serial number.
              const take = (text) => (this.serial = new TextDecoder('utf-16le').decode(Uint8Array.from(text.slice(2))));
              describe(STRING, 255, take, device[16]);
              if (this.opens) this.after(OPENS, () => this.open());
            });
          }),
        );
      }),
    );
  }

  /** Opens the port: 115,200 bits per second, 8N1, and DTR. */
  open() {
    if (!this.isConfigured) return;
    this.request(setup(0x21, 0x20, 0, 0, 7), () => this.lines(3), [0, 0xc2, 1, 0, 0, 0, 8]);
  }

  /** Closes the port. */
  close() {
    this.isOpen = false;
    this.lines(0);
  }

  lines(value) {
    this.request(setup(0x21, 0x22, value, 0, 0), () => {
      if (value === 0) return;
      this.isOpen = true;
      this.times.opened += 1;
      this.held?.();
    });
  }

  /** Lets the program read again, or not. */
  read(isReading) {
    this.isReading = isReading;
    if (isReading) this.held?.();
  }

  /** Sends bytes when the device takes them. */
  send(bytes) {
    this.outgoing.push(...bytes);
    if (this.waits) this.wanted(this.ends[0]);
  }

  /** The device takes a packet. */
  wanted(endpoint) {
    if (endpoint === 0) {
      const bytes = this.control.left ?? [];
      this.control.left = null;
      this.give(0, bytes);
      // A request for bytes ends with an empty packet to the device.
      if (this.control.length > 0) this.after(1e6, () => this.control.then(this.control.got));
    } else if (endpoint === this.ends?.[0]) {
      this.waits = this.outgoing.length === 0;
      if (!this.waits) this.give(endpoint, this.outgoing.splice(0, PACKET));
    }
  }

  /** Gives a packet to the device, whose buffer was empty. */
  give(endpoint, bytes) {
    this.after(1e4, () => {
      const at = BUFFERS + 4 + 8 * endpoint, view = this.usb.rp2040.usbDPRAMView;
      view.setUint32(at, view.getUint32(at, true) & ~AVAILABLE, true);
      this.usb.finishRead(endpoint, Uint8Array.from(bytes));
    });
  }

  /** A packet of the device has arrived. */
  arrived(endpoint, bytes) {
    if (endpoint === this.ends?.[1]) return this.take(bytes);
    if (endpoint !== 0) return;
    if (this.control.length > 0) this.control.got.push(...bytes);
    else this.after(1e6, () => this.control.then(this.control.got));
  }
}

/** Returns the numbers of the bulk endpoints of a configuration's CDC data interface: to the device, and from it. */
function bulk(all) {
  const found = [];
  let isData = false;
  for (let at = 0; at < all.length; at += all[at]) {
    if (all[at + 1] === 4) isData = all[at + 5] === 10;
    if (isData && all[at + 1] === 5 && (all[at + 3] & 3) === 2) found[all[at + 2] >> 7] = all[at + 2] & 15;
  }
  return found;
}
