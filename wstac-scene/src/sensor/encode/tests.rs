use wstac_core::green::ycbcr::{QuantizationRange, YcbcrMatrix};

use super::*;

/// Encodes 2 × 2 pixels of red, green and blue, one row after the other if a cell has one.
fn bytes(format: &str, pixels: [[u16; 3]; 4], frame_bytes: usize) -> Vec<u8> {
    let format: SensorFormat = format.parse().unwrap();
    let encoder =
        encoder(format, YcbcrEncoding { matrix: YcbcrMatrix::Bt601, range: QuantizationRange::Full }).unwrap();
    let mut frame = Frame { bytes: vec![0; frame_bytes], bytes_per_row: 0, height: 2 };
    frame.bytes_per_row = match format.pixels() {
        // These are the bytes of luma.
        PixelFormat::Nv12 | PixelFormat::Yu12 | PixelFormat::Yuv422p | PixelFormat::Yuv444p => 2,
        _ => frame_bytes / 2,
    };
    let [_, rows] = encoder.cell();
    for top in (0..2).step_by(rows) {
        let colors = [0, 1, 2]
            .map(|color| -> Vec<u16> { pixels[2 * top..2 * (top + rows)].iter().map(|pixel| pixel[color]).collect() });
        encoder.encode(&Block { left: 0, top, width: 2, colors: colors.each_ref().map(Vec::as_slice) }, &mut frame);
    }
    frame.bytes
}

/// Checks every order of bytes, as V4L2 describes it.
///
/// In BT.601, full range, this color is 124, 86, 182.
#[test]
fn bytes_are_where_v4l2_puts_them() {
    const BITS: u16 = 24 << 11 | 25 << 5 | 6;
    let rgb565 = BITS.to_le_bytes();
    let cases: [(&str, &[u8], usize); 15] = [
        ("GREY", &[100], 4),
        ("Y16", &[100, 0], 4),
        ("RGGB", &[100], 4),
        ("BG10", &[100, 0], 4),
        ("RGB3", &[200, 100, 50], 4),
        ("BGR3", &[50, 100, 200], 4),
        ("XR24", &[50, 100, 200, 255], 4),
        ("AR24", &[50, 100, 200, 255], 4),
        ("XB24", &[200, 100, 50, 255], 4),
        ("BX24", &[255, 200, 100, 50], 4),
        ("RGB4", &[255, 200, 100, 50], 4),
        ("RX24", &[255, 50, 100, 200], 4),
        ("RGBP", &rgb565, 4),
        ("YUYV", &[124, 86, 124, 182], 2),
        ("UYVY", &[86, 124, 182, 124], 2),
    ];
    for (format, expected, times) in cases {
        let expected = expected.repeat(times);
        assert_eq!(bytes(format, [[200, 100, 50]; 4], expected.len()), expected, "{format}");
    }
    for (format, expected) in [
        ("NV12", &[124, 124, 124, 124, 86, 182][..]),
        ("YU12", &[124, 124, 124, 124, 86, 182]),
        ("422P", &[124, 124, 124, 124, 86, 86, 182, 182]),
    ] {
        assert_eq!(bytes(format, [[200, 100, 50]; 4], expected.len()), expected, "{format}");
    }
}

#[test]
fn chroma_is_the_mean_of_its_cell() {
    // Blue has a Cb of 255 when alone, and black has 128.
    let pixels = [[0, 0, 255], [0, 0, 0], [0, 0, 0], [0, 0, 0]];
    assert_eq!(bytes("YUYV", pixels, 8), [29, 192, 0, 118, 0, 128, 0, 128]);
    assert_eq!(bytes("NV12", pixels, 6), [29, 0, 0, 0, 160, 123]);
    assert_eq!(bytes("422P", pixels, 8), [29, 0, 0, 0, 192, 128, 118, 128]);
}

#[test]
fn a_mosaics_sites_are_named_in_its_order() {
    for (format, expected) in [("RGGB", "RGGB"), ("GRBG", "GRBG"), ("GB10", "GBRG"), ("BG12", "BGGR")] {
        let mosaic = Mosaic::of(format.parse::<SensorFormat>().unwrap().pixels()).unwrap();
        let sites = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| match mosaic.site(x + 2, y + 4) {
            Site::Red => 'R',
            Site::Green => 'G',
            Site::Blue => 'B',
        });
        assert_eq!(sites.iter().collect::<String>(), expected);
    }
}
