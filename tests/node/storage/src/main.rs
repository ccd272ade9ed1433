//! A router of Zenoh with its storage plugin, by the settings of a file. It runs until it is killed.
//!
//!     wstac-node-storage CONFIG.json5

use std::time::Duration;

use zenoh::Config;
use zenoh::internal::runtime::RuntimeBuilder;
use zenoh_plugin_storage_manager::StoragesPlugin;
use zenoh_plugin_trait::Plugin;

fn main() -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let path = std::env::args().nth(1).ok_or("usage: wstac-node-storage CONFIG.json5")?;
    let config = Config::from_file(path)?;
    let threads = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    threads.block_on(async {
        let mut runtime = RuntimeBuilder::new(config).build().await?;
        let shared = runtime.clone().into();
        let _storages = StoragesPlugin::start("storage-manager", &shared)?;
        let _session = zenoh::session::init(shared).await?;
        runtime.start().await?;
        println!("ready");
        loop {
            tokio::time::sleep(Duration::from_secs(60)).await;
        }
    })
}
