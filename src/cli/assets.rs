//! `understudy assets`: what the set-up brought, and whether it is what it should be.

use clap::Args;
use understudy::assets::{Assets, Condition};

use super::Outcome;

/// List the models, clips and scans that the set-up brings, and verify them
#[derive(Args)]
pub struct AssetsCommand {
    /// Print the path of one asset, verified, and nothing else
    #[arg(value_name = "NAME")]
    name: Option<String>,
}

impl AssetsCommand {
    pub fn run(&self) -> Outcome {
        let assets = Assets::locate()?;
        if let Some(name) = &self.name {
            say!("{}", assets.verified(name)?.display());
            return Ok(());
        }
        say!("{}", assets.root().display());
        let mut bad = 0;
        for (asset, condition) in assets.check() {
            bad += usize::from(condition != Condition::Verified);
            say!(
                "  {condition:<9} {:<26} {:<12} {:<34} {}",
                asset.name,
                asset.licence,
                asset.package,
                asset.path.display()
            );
        }
        if bad == 0 {
            Ok(())
        } else {
            Err(format!("{bad} assets are missing or corrupt. Run `make setup`").into())
        }
    }
}
