//! Frames of a link whose COBS and CRC are correct.

/// Returns a frame with this content.
pub(crate) fn with_content(content: &[u8]) -> Vec<u8> {
    let content = [content, &crc32fast::hash(content).to_le_bytes()].concat();
    let mut bytes = vec![0];
    for mut block in content.split(|&byte| byte == 0) {
        while let Some((full, rest)) = block.split_at_checked(254) {
            bytes.push(255);
            bytes.extend(full);
            block = rest;
        }
        bytes.push(block.len() as u8 + 1);
        bytes.extend(block);
    }
    bytes.push(0);
    bytes
}
