//! `view`: a page on the loopback that shows a scene while it renders.
//!
//! One thread computes (`worker`): it takes the page's last wish, which is the flags of a command,
//! does no more than the wish asks for (`subject`), shows a sketch at once and then the render in
//! pieces (`progress`). Others answer requests (`server`, `http`). They meet in `shared`, and
//! nowhere else.

mod flags;
mod http;
mod layers;
mod progress;
mod save;
mod server;
mod shared;
mod status;
mod subject;
mod worker;

use std::process::{Command, Stdio};
use std::sync::Arc;
use std::thread;

use crate::args::ViewerArgs;
use crate::console::{self, Verbosity};
use crate::failure::{Exit, Failure};
use crate::threads::{Threads, refused};
use crate::{interrupt, origin, scene_input, words};
use flags::CommandLine;
use server::Server;
use shared::{Shared, Wish};
use worker::Worker;

/// Serves the page until nobody looks at it any more.
pub fn run(args: ViewerArgs, verbosity: Verbosity) -> Result<(), Failure> {
    let scene = match args.render.scenes.as_slice() {
        [] => scene_input::unnamed()?,
        [scene] if scene == "-" => {
            return Err(Failure::new(
                Exit::Usage,
                "standard input is read once, and a viewer reads its scene again and again",
            ));
        }
        [scene] => scene.clone(),
        _ => {
            return Err(Failure::new(Exit::Usage, "a viewer shows one scene")
                .with_hint("begin one for each"));
        }
    };
    let (stop, threads) = (
        interrupt::flag()?,
        Threads::new(args.render.machine.threads)?,
    );
    let (line, flags) =
        CommandLine::of_program(scene.clone(), words::with_command(origin::words().to_vec()));
    let shared = Arc::new(Shared::default());
    shared.wish(Wish {
        flags,
        ..Wish::default()
    });
    let mut worker = Worker::new(scene, line, shared.clone(), threads, stop);
    worker.watches = args.watch;
    worker.linger = (!args.keep).then_some(args.linger);
    worker.begin()?;
    let server = Server::start(args.port, shared).map_err(|cause| {
        Failure::new(
            Exit::Failed,
            format_args!(
                "cannot listen on this machine's port {}: {cause}",
                args.port
            ),
        )
    })?;
    let address = server.address();
    thread::Builder::new()
        .spawn(move || server.serve())
        .map_err(|cause| refused(&cause))?;
    console::print(format!("{address}\n"))?;
    verbosity.say("open this address in a browser; Ctrl-C ends the viewer");
    if !args.no_open {
        open(&address);
    }
    worker.work();
    Ok(())
}

/// Opens the page where the system has a program for that. Where it has none, the address was
/// printed.
fn open(address: &str) {
    let program = if cfg!(target_os = "macos") {
        "open"
    } else {
        "xdg-open"
    };
    let quietly = || Stdio::null();
    if let Ok(mut opened) = Command::new(program)
        .arg(address)
        .stdin(quietly())
        .stdout(quietly())
        .stderr(quietly())
        .spawn()
    {
        // Waited for, so that nothing of it stays when it has ended; where there is no thread, it
        // stays until the program ends.
        let _ = thread::Builder::new().spawn(move || opened.wait());
    }
}
