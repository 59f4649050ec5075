//! `view`: a page on the loopback interface that shows a scene while it renders.
//!
//! One thread computes (`worker`): it loads the scene, while the page shows the stages, and then
//! serves the page's latest request, a set of flags. The thread does only the work that the request
//! needs (`viewed_scene`): first a coarse preview, then the render in slices of time (`progress`).
//! Other threads serve HTTP requests (`server`). All threads communicate through `shared` only.

mod flags;
mod layers;
mod progress;
mod server;
mod shared;
mod status;
mod viewed_scene;
mod worker;

use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;
use std::{panic, thread};

use crate::args::ViewerArgs;
use crate::failure::{Exit, Failure};
use crate::session::Session;
use crate::threads::thread_start_failure;
use crate::{STACK_BYTES, command_words, console, origin, scene_input};
use flags::ViewCommand;
use server::ViewServer;
use shared::{SharedView, ViewRequest};
use worker::ViewWorker;

/// Runs `view`: serves the page until it has been closed for the time of `--linger`, or until
/// Ctrl-C.
pub fn run(mut session: Session, args: ViewerArgs) -> Result<(), Failure> {
    let scene = match args.render.scenes.as_slice() {
        [] => scene_input::default_scene_name()?,
        [scene] if scene == "-" => {
            return Err(Failure::new(
                Exit::Usage,
                "the viewer reads the scene several times, which standard input does not permit; save the scene to a file and name the file",
            ));
        }
        [scene] => scene.clone(),
        _ => {
            return Err(Failure::new(Exit::Usage, "the viewer shows a single scene")
                .with_hint("start a viewer for each scene"));
        }
    };
    let (command, flags) = ViewCommand::from_command_line(
        scene.clone(),
        command_words::insert_command(origin::run_arguments().to_vec()),
    );
    let shared = Arc::new(SharedView::default());
    shared.submit_request(ViewRequest {
        flags,
        ..ViewRequest::default()
    });
    let verbosity = session.verbosity;
    // The worker begins a stage of its own with each load.
    session.end_early_stage();
    let server = ViewServer::start(args.port, shared.clone())
        .and_then(|server| Ok((server.address()?, server)));
    let ((address, port), server) = server.map_err(|cause| {
        Failure::new(
            Exit::Failed,
            format_args!(
                "cannot listen on this machine's port {}: {cause}",
                args.port
            ),
        )
        .with_hint("choose another port with --port, or leave out --port for a free port")
    })?;
    let (sender, loaded) = sync_channel(1);
    let mut worker = ViewWorker::new(scene, command, shared, session);
    worker.watches_files = args.watch;
    worker.linger = (!args.keep).then_some(args.linger);
    let starts = [
        thread::Builder::new().spawn(move || {
            server.serve();
            Ok(())
        }),
        thread::Builder::new()
            .stack_size(STACK_BYTES)
            .spawn(move || worker.run(&sender)),
    ];
    let [serving, work] = starts.map(|start| start.map_err(|cause| thread_start_failure(&cause)));
    serving?;
    let work = work?;
    // A scene that cannot be loaded fails soon, and then needs no page. The page of any other scene
    // does not wait for it.
    let has_page = loaded.recv_timeout(PAGE_DELAY) != Err(RecvTimeoutError::Disconnected);
    if has_page {
        console::print(format!("{address}\n"))?;
        verbosity.print_result_message(format_args!(
            "open this address in a browser of this machine; from another machine, first run there: \
             ssh -L {port}:127.0.0.1:{port} THIS-MACHINE; Ctrl-C ends the viewer"
        ));
        if !args.no_open {
            open_browser(&address);
        }
    }
    let ended = work
        .join()
        .unwrap_or_else(|panic| panic::resume_unwind(panic));
    if has_page && ended.is_err() {
        thread::sleep(FAILURE_DELAY);
    }
    ended
}

/// Longest wait for the scene before the page is opened.
const PAGE_DELAY: Duration = Duration::from_millis(400);
/// Time for an open page to receive the failure that ends the program.
const FAILURE_DELAY: Duration = Duration::from_millis(500);

/// Opens the page in the system's browser, if the system has a program for this. The address is
/// printed in any case.
fn open_browser(address: &str) {
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
        // A thread waits for the end of the opener, so that no zombie process remains. If the
        // thread cannot start, the zombie lasts until the program ends.
        let _ = thread::Builder::new().spawn(move || opened.wait());
    }
}
