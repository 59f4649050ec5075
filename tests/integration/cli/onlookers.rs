//! Live previews: in a file that is updated, and in tev, replaced here by a server that decodes its
//! packets.

use std::collections::{BTreeMap, HashSet};
use std::io::Read;
use std::net::TcpListener;
use std::process::Stdio;
use std::thread;

use raywright::io::Limits;
use raywright::io::output::read_picture;

use crate::support::Sandbox;

/// A ball on the ground under the grey sky, with random light samples.
const SCENE: &str = r#"
format = 1
render = { size = [48, 32], samples = 256, integrator = "path" }
sky.gradient = { bottom = [0.2, 0.2, 0.2], top = [1, 1, 1] }
[[materials]]
name = "m"
model.physical = { base_colour = [0.7, 0.4, 0.2], roughness = 0.7 }
[[objects]]
material = "m"
shape.sphere = { centre = [0, 0.5, 0], radius = 0.5 }
[[objects]]
material = "m"
shape.quad = { corner = [-2, 0, 2], edge_u = [4, 0, 0], edge_v = [0, 0, -4] }
"#;

/// A received picture: its size, and each update of its channels' values.
#[derive(Default)]
struct ShownPicture {
    size: [u32; 2],
    channels: BTreeMap<String, Vec<f32>>,
    created: usize,
    updated: usize,
}

/// A packet that is decoded from its beginning.
struct PacketReader<'a>(&'a [u8]);

impl PacketReader<'_> {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let (first, rest) = self.0.split_at(N);
        self.0 = rest;
        first.try_into().expect("so many bytes")
    }

    fn number(&mut self) -> u32 {
        u32::from_le_bytes(self.bytes())
    }

    fn text(&mut self) -> String {
        let end = self
            .0
            .iter()
            .position(|&byte| byte == 0)
            .expect("a text that ends");
        let text = String::from_utf8(self.0[..end].to_vec()).expect("text");
        self.0 = &self.0[end + 1..];
        text
    }
}

impl ShownPicture {
    /// Decodes a packet as tev does (its `Ipc.cpp`): pictures are created, and then updated by
    /// offsets and strides.
    fn take(&mut self, packet: &[u8]) {
        let mut reader = PacketReader(packet);
        assert_eq!(reader.number() as usize, packet.len());
        let [kind, focus] = reader.bytes();
        assert!(focus <= 1);
        assert_eq!(reader.text(), "ball");
        match kind {
            4 => {
                self.size = [reader.number(), reader.number()];
                let pixels = (self.size[0] * self.size[1]) as usize;
                self.channels = (0..reader.number())
                    .map(|_| (reader.text(), vec![f32::NAN; pixels]))
                    .collect();
                self.created += 1;
            }
            6 => {
                let names: Vec<String> = (0..reader.number()).map(|_| reader.text()).collect();
                let [x, y, width, height] = [(); 4].map(|()| reader.number() as usize);
                let mut longs = || {
                    names
                        .iter()
                        .map(|_| u64::from_le_bytes(reader.bytes()) as usize)
                        .collect::<Vec<_>>()
                };
                let (offsets, strides) = (longs(), longs());
                let values: Vec<f32> = reader
                    .0
                    .chunks_exact(4)
                    .map(|four| f32::from_le_bytes(four.try_into().expect("four")))
                    .collect();
                let last = |i: usize| offsets[i] + (width * height - 1) * strides[i] + 1;
                assert_eq!((0..names.len()).map(last).max(), Some(values.len()));
                for (i, name) in names.iter().enumerate() {
                    let channel = self
                        .channels
                        .get_mut(name)
                        .expect("a channel that was created");
                    for pixel in 0..width * height {
                        let place = (y + pixel / width) * self.size[0] as usize + x + pixel % width;
                        channel[place] = values[offsets[i] + pixel * strides[i]];
                    }
                }
                self.updated += 1;
            }
            other => panic!("a packet of kind {other}"),
        }
    }
}

/// Protects: tev receives a picture, its update at each doubling of its samples, and its end, in
/// valid packets with the layers available at the time; its last picture equals the file, and the
/// bits equal those of a render without previews.
#[test]
fn tev_is_shown_each_stage() {
    let sandbox = Sandbox::new();
    sandbox.write("ball.scene.toml", SCENE);
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let display = format!(
        "tev:127.0.0.1:{}",
        listener.local_addr().expect("an address").port()
    );
    let server = thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("a connection");
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).expect("packets");
        let (mut shown, mut rest) = (ShownPicture::default(), bytes.as_slice());
        while let Some(length) = rest
            .first_chunk()
            .map(|&four| u32::from_le_bytes(four) as usize)
        {
            let (packet, after) = rest.split_at(length);
            shown.take(packet);
            rest = after;
        }
        shown
    });
    let words = [
        "render",
        "ball.scene.toml",
        "--denoise",
        "--hash",
        "-o",
        "a.exr",
        "--display",
        &display,
    ];
    let hash = sandbox
        .run(&words)
        .exits_with(0)
        .text()
        .split_whitespace()
        .next()
        .expect("a hash")
        .to_owned();
    let shown = server.join().expect("packets that can be read");
    assert!(
        shown.updated >= 6 && (1..=2).contains(&shown.created),
        "{} pictures, {} updates",
        shown.created,
        shown.updated
    );
    assert_eq!(shown.size, [48, 32]);
    let picture = sandbox.picture("a.exr");
    for (channel, name) in ["R", "G", "B"].into_iter().enumerate() {
        assert!(
            picture
                .rgb
                .iter()
                .map(|rgb| rgb[channel])
                .eq(shown.channels[name].iter().copied()),
            "{name}"
        );
        let denoised = &picture
            .layer(&format!("denoised.{name}"))
            .expect("a layer")
            .samples;
        assert_eq!(denoised, &shown.channels[&format!("denoised.{name}")]);
        assert!(
            shown.channels[&format!("stderr.{name}")]
                .iter()
                .all(|&error| error >= 0.0),
            "{name}"
        );
    }
    let alone = sandbox.run(&[
        "render",
        "ball.scene.toml",
        "--denoise",
        "--hash",
        "-o",
        "b.exr",
    ]);
    assert!(alone.exits_with(0).text().starts_with(&hash));
}

/// Protects: an unreachable viewer is reported before the render.
#[test]
fn a_viewer_that_is_not_there_is_told() {
    let sandbox = Sandbox::new();
    sandbox.write("ball.scene.toml", SCENE);
    let port = TcpListener::bind("127.0.0.1:0")
        .and_then(|listener| listener.local_addr())
        .expect("an address")
        .port();
    let display = format!("tev:127.0.0.1:{port}");
    sandbox
        .run(&["render", "ball.scene.toml", "--display", &display])
        .exits_with(4)
        .prints_like("start tev first");
    sandbox
        .run(&["render", "ball.scene.toml", "--display", "window"])
        .exits_with(2)
        .prints_like("expected tev");
    assert_eq!(sandbox.names(), ["ball.scene.toml"]);
}

/// Protects: a preview file is a complete picture at any time, differs during the render, and ends
/// as the final picture; it replaces no input, and applies to a single picture.
#[test]
fn a_preview_grows() {
    let sandbox = Sandbox::new();
    sandbox.write("ball.scene.toml", SCENE);
    let words = [
        "render",
        "ball.scene.toml",
        "-s",
        "200x150",
        "--spp",
        "512",
        "--preview",
        "p.png",
        "-o",
        "o.png",
        "-q",
    ];
    let mut child = sandbox
        .command(&words)
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut seen = HashSet::new();
    while child.try_wait().expect("a child").is_none() {
        let Ok(bytes) = std::fs::read(sandbox.path("p.png")) else {
            continue;
        };
        sandbox.write("look.png", &bytes);
        let stored_picture =
            read_picture(&sandbox.path("look.png"), &Limits::default()).expect("a whole picture");
        assert_eq!(
            [stored_picture.picture.width, stored_picture.picture.height],
            [200, 150]
        );
        seen.insert(bytes);
    }
    assert!(child.wait().expect("a child").success());
    assert!(seen.len() >= 4, "{} stages were seen", seen.len());
    assert_eq!(sandbox.picture("p.png"), sandbox.picture("o.png"));
    assert_eq!(
        sandbox.names(),
        ["ball.scene.toml", "look.png", "o.png", "p.png"]
    );

    let refused = |words: &[&str], reason: &str| {
        let words = [&["render", "ball.scene.toml"], words].concat();
        sandbox.run(&words).exits_with(2).prints_like(reason);
    };
    refused(&["--preview", "p.exr"], "use a name that ends in .png");
    refused(&["--preview", "o.png", "-o", "o.png"], "named twice");
    refused(
        &["--preview", "p.png", "--views", "front,left"],
        "needs a single picture",
    );
    let texture =
        "[[images]]\nname = \"i\"\npath = \"p.png\"\n[[textures]]\nname = \"t\"\nimage = \"i\"\n";
    let textured = SCENE.replace(
        "base_colour = [0.7, 0.4, 0.2]",
        "base_colour_texture = { name = \"t\" }",
    ) + texture;
    sandbox.write("ball.scene.toml", textured);
    let before = std::fs::read(sandbox.path("p.png")).expect("a file");
    let run = sandbox.run(&[
        "render",
        "ball.scene.toml",
        "--preview",
        "p.png",
        "-o",
        "q.png",
    ]);
    run.exits_with(2).prints_like("this run reads it");
    assert_eq!(
        std::fs::read(sandbox.path("p.png")).expect("a file"),
        before
    );
}
