//! Decodes any bytes as a link, from a board and from a host. Also decodes a frame of any content whose COBS and CRC
//! are correct. The results are messages or refusals, and a message that is encoded again must not change.
#![no_main]

mod frame;

use libfuzzer_sys::fuzz_target;
use wstac_core::wire::{Decoder, LONGEST, LONGEST_REQUEST, Message, Request, encode};

fuzz_target!(|data: &[u8]| {
    let mut messages = Decoder::<LONGEST>::new();
    let mut requests = Decoder::<LONGEST_REQUEST>::new();
    for &byte in data.iter().chain(&[0]) {
        let _ = messages.push::<Message>(byte);
        let _ = requests.push::<Request>(byte);
    }
    for &byte in &frame::with_content(&data[..data.len().min(LONGEST_REQUEST - 7)]) {
        let Some(Ok(received)) = requests.push::<Request>(byte) else { continue };
        let mut buffer = [0; LONGEST];
        let again = encode(&received.message, 7, &mut buffer);
        let mut decoder = Decoder::<LONGEST_REQUEST>::new();
        let found = again.iter().find_map(|&byte| decoder.push::<Request>(byte));
        assert_eq!(found.map(|second| second.map(|second| second.message)), Some(Ok(received.message)));
    }
    for &byte in &frame::with_content(&data[..data.len().min(LONGEST - 7)]) {
        let Some(Ok(received)) = messages.push::<Message>(byte) else { continue };
        let mut buffer = [0; LONGEST];
        let again = encode(&received.message, 7, &mut buffer);
        let mut decoder = Decoder::<LONGEST>::new();
        let mut found = 0;
        for &byte in again {
            if let Some(second) = decoder.push::<Message>(byte) {
                // Compares texts, because NaN is not equal to itself.
                let second = second.expect("a message that was encoded").message;
                assert_eq!(format!("{second:?}"), format!("{:?}", received.message));
                found += 1;
            }
        }
        assert_eq!(found, 1, "{:?}", received.message);
    }
});
