//! Compresses the map and the prices, of whose 0.9 MB a program then has a twelfth.

use std::io::Write;
use std::path::Path;
use std::{env, fs, io};

use flate2::Compression;
use flate2::write::DeflateEncoder;

fn main() -> io::Result<()> {
    println!("cargo:rerun-if-changed=data");
    let folder = env::var_os("OUT_DIR").expect("cargo sets it");
    for name in ["map.csv", "prices.json"] {
        let mut encoder = DeflateEncoder::new(fs::File::create(Path::new(&folder).join(name))?, Compression::best());
        encoder.write_all(&fs::read(Path::new("data").join(name))?)?;
        encoder.finish()?;
    }
    Ok(())
}
