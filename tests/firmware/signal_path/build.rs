//! Links like the programs of wstac-fw, whose build knows the memories, and adds the C code of `WSTAC_PEERS`.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=WSTAC_PEERS");
    let peers = std::env::var("WSTAC_PEERS")
        .expect("WSTAC_PEERS is not set, expected an object file: tests/firmware/signal_path.py makes it");
    println!("cargo:rerun-if-changed={peers}");
    println!("cargo:rustc-link-arg={peers}");
    println!("cargo:rustc-link-arg=-Tlink.x");
}
