//! How to link: as wstac-fw's programs, whose memories are known by its build, with the peers' C code that `WSTAC_PEERS` names.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=WSTAC_PEERS");
    let peers = std::env::var("WSTAC_PEERS")
        .expect("WSTAC_PEERS is not set, expected an object file: tests/firmware/signal_path.py makes it");
    println!("cargo:rerun-if-changed={peers}");
    println!("cargo:rustc-link-arg={peers}");
    println!("cargo:rustc-link-arg=-Tlink.x");
}
