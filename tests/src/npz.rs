//! Writes data sets like `savez` of NumPy.
//!
//! The files are made byte by byte and not with the writer of `wstac-train`, so that reader and writer do not share a
//! mistake.

/// Returns an `.npz` file of arrays: name, header and data of each. Its members are stored without checksums, which the
/// reader does not check.
pub fn npz<H: AsRef<str>>(arrays: &[(&str, H, Vec<u8>)]) -> Vec<u8> {
    let (mut archive, mut directory) = (Vec::new(), Vec::new());
    for (name, header, data) in arrays {
        let (name, header) = (format!("{name}.npy"), header.as_ref());
        let mut npy = b"\x93NUMPY\x01\x00".to_vec();
        npy.extend((header.len() as u16).to_le_bytes());
        npy.extend(header.as_bytes());
        npy.extend(data);
        let mut common = vec![20, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        common.extend([(npy.len() as u32).to_le_bytes(); 2].concat());
        common.extend((name.len() as u16).to_le_bytes());
        common.extend([0, 0]);
        directory.extend(b"PK\x01\x02\x14\x03");
        directory.extend(&common);
        directory.extend([0; 10]);
        directory.extend((archive.len() as u32).to_le_bytes());
        directory.extend(name.as_bytes());
        archive.extend(b"PK\x03\x04");
        archive.extend(common);
        archive.extend(name.as_bytes());
        archive.extend(npy);
    }
    let start = archive.len() as u32;
    archive.extend(&directory);
    archive.extend(b"PK\x05\x06\0\0\0\0\0\0\0\0");
    archive.extend((directory.len() as u32).to_le_bytes());
    archive.extend(start.to_le_bytes());
    archive.extend([0, 0]);
    archive
}

/// Returns the header of an array in the format of NumPy.
pub fn header(descr: &str, shape: &str) -> String {
    format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n")
}

/// Returns the archive of [`npz`] as zip64, which has sizes and places of more than 32 bits.
pub fn zip64(arrays: &[(&str, String, Vec<u8>)]) -> Vec<u8> {
    let entry = |field: usize, rest: &[u8]| rest[field..].first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
    let small = npz(arrays);
    let end = small.len() - 22;
    let number = |at: usize| entry(at, &small) as usize;
    let (mut rest, at) = (&small[number(end + 16)..end], number(end + 16));
    let mut archive = small[..at].to_vec();
    while !rest.is_empty() {
        let name = usize::from(rest[28]);
        let mut header = rest[..46].to_vec();
        let large = [entry(24, rest), entry(20, rest), entry(42, rest)].map(|number| u64::from(number).to_le_bytes());
        // Sizes and the place are all ones if they are in the extras: some other field, then that of zip64.
        header[20..28].fill(0xFF);
        header[42..46].fill(0xFF);
        header[30] = 6 + 4 + 24;
        archive.extend(header);
        archive.extend(&rest[46..46 + name]);
        archive.extend([9, 9, 2, 0, 7, 7, 1, 0, 24, 0]);
        archive.extend(large.as_flattened());
        rest = &rest[46 + name..];
    }
    let (bytes, record) = (archive.len() - at, archive.len() as u64);
    archive.extend(b"PK\x06\x06");
    archive.extend([44, 0, 0, 0, 0, 0, 0, 0, 45, 0, 45, 0]);
    archive.extend([0; 24]);
    archive.extend([bytes as u64, at as u64].map(u64::to_le_bytes).as_flattened());
    archive.extend(b"PK\x06\x07\0\0\0\0");
    archive.extend(record.to_le_bytes());
    archive.extend([1, 0, 0, 0]);
    archive.extend(b"PK\x05\x06\0\0\0\0");
    archive.extend([0xFF; 12]);
    archive.extend([0, 0]);
    archive
}
