//! One file a command.

/// Prints a line; a reader that has gone away, as `head` does, is no error.
macro_rules! say {
    ($($words:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stdout(), $($words)*);
    }};
}

mod animate;
mod animate_outputs;
mod assets;
mod author;
mod average;
mod basis;
mod clip;
mod compare;
mod curve_files;
mod express;
mod inputs;
mod landmark;
mod learn_appearance;
mod method;
mod muscles;
mod plot;
mod prepare;
mod preprocess;
mod progress;
mod receive;
mod refine;
mod render;
mod send;
mod skin;
mod target;
mod track;
mod volume;

use std::{error::Error, io, process::ExitCode};

use clap::{Parser, Subcommand};
use tracing_subscriber::EnvFilter;

/// What a command returns: any of the library's errors, or one of its own.
type Outcome = Result<(), Box<dyn Error>>;

const EXAMPLES: &str = "\
Examples:
  understudy animate clip.mp4 --target scan.obj -o avatar.mp4 -o avatar.glb
  understudy express --target scan.obj --emotion happiness -o happy.png
  understudy express --target scan.obj --play take.muscles.csv -o scene.mp4
  understudy track clip.mp4 -o motion.csv -o take.muscles.csv
  understudy landmark scan.obj -o picture.png -o scan.landmarks.json
  understudy prepare scan.obj -o avatar.glb -o look.png
  understudy preprocess scan.obj -o grid.obj -o picture.png
  understudy average scans/*.obj -o average.obj
  understudy render scan.obj -o look.png --yaw 30
  understudy compare --neutral n.obj --predicted p.obj --truth t.obj -o error.png
  understudy author --neutral rest.obj --expressive smile.obj --au 12 -o library.json
  understudy plot take.muscles.csv -o curves.svg
  understudy muscles --target scan.obj -o muscles.png
  understudy refine takes/*.csv --basis sixteen -o mine.json
  understudy send clip.mp4 --to 7331
  understudy receive --listen 7331 --target scan.obj -o avatar.mp4
  understudy learn-appearance faces.mp4 -o me.skin --sheet me.png
  understudy assets";

/// A performer drives a scanned 3D face.
#[derive(Parser)]
#[command(version, about, after_help = EXAMPLES, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Say more (-v) or all (-vv) of what is going on.
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    verbose: u8,
    /// Say nothing but errors.
    #[arg(short, long, global = true)]
    quiet: bool,
}

#[derive(Subcommand)]
enum Command {
    Animate(Box<animate::Animate>),
    Express(Box<express::Express>),
    Track(Box<track::Track>),
    Landmark(landmark::Landmark),
    Prepare(prepare::Prepare),
    Preprocess(Box<preprocess::Preprocess>),
    Average(Box<average::Average>),
    Render(render::Render),
    Compare(compare::Compare),
    Author(author::Author),
    Plot(plot::Plot),
    Muscles(Box<muscles::Muscles>),
    Refine(refine::Refine),
    Send(Box<send::Send>),
    Receive(Box<receive::Receive>),
    LearnAppearance(Box<learn_appearance::LearnAppearance>),
    Assets(assets::AssetsCommand),
}

/// Parses the command line, runs the command, reports its error.
pub fn run() -> ExitCode {
    let cli = Cli::parse();
    let level = match (cli.quiet, cli.verbose) {
        (true, _) => "error",
        (false, 0) => "understudy=warn,error",
        (false, 1) => "understudy=info,warn",
        (false, _) => "understudy=debug,info",
    };
    let filter = EnvFilter::try_from_env("UNDERSTUDY_LOG").unwrap_or_else(|_| EnvFilter::new(level));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(io::stderr)
        .without_time()
        .with_target(false)
        .init();
    let outcome = match cli.command {
        Command::Animate(command) => command.run(cli.quiet),
        Command::Express(command) => command.run(cli.quiet),
        Command::Track(command) => command.run(cli.quiet),
        Command::Landmark(command) => command.run(cli.quiet),
        Command::Prepare(command) => command.run(cli.quiet),
        Command::Preprocess(command) => command.run(cli.quiet),
        Command::Average(command) => command.run(cli.quiet),
        Command::Render(command) => command.run(cli.quiet),
        Command::Compare(command) => command.run(cli.quiet),
        Command::Author(command) => command.run(cli.quiet),
        Command::Plot(command) => command.run(cli.quiet),
        Command::Muscles(command) => command.run(cli.quiet),
        Command::Refine(command) => command.run(cli.quiet),
        Command::Send(command) => command.run(cli.quiet),
        Command::Receive(command) => command.run(cli.quiet),
        Command::LearnAppearance(command) => command.run(cli.quiet),
        Command::Assets(command) => command.run(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
