//! `--display-server` shows the image whole, and no viewer can stop, change or fail a render.
//!
//! The receiver here follows tev's own description of its packets (src/Ipc.cpp there): a length that counts itself (u32), a type (u8), and fields,
//! little-endian; texts end with a zero.

use std::fs;
use std::io::Read as _;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Command, Output};
use std::thread;
use std::time::Instant;

use lightmesh::image::{self, Image};

const MODEL: &str = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n";
const SCENE: &str = "background = [0.1, 0.2, 0.3]\n[camera]\nposition = [0, 0, 3]\nlook_at = [0, 0, 0]\n[[geometry]]\nfile = \"model.obj\"\n\
                     [[light]]\nposition = [0, 0, 2]\nintensity = 1\n[render]\nspp = 1\nintegrator = \"conventional\"\n";

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("model.obj"), MODEL).expect("writable");
    fs::write(folder.path().join("scene.toml"), SCENE).expect("writable");
    folder
}

fn render(folder: &Path, resolution: &str, flags: &[&str]) -> (Output, Vec<u8>) {
    let output = Command::new(env!("CARGO_BIN_EXE_lightmesh"))
        .args(["render", "scene.toml", "-o", "out.exr", "--float", "--resolution", resolution])
        .args(flags)
        .current_dir(folder)
        .output()
        .expect("the program runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    (output, fs::read(folder.join("out.exr")).expect("an image"))
}

fn server() -> (TcpListener, String) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    (listener, address)
}

/// The fields of a packet.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (field, rest) = self.0.split_first_chunk().expect("a field");
        self.0 = rest;
        *field
    }

    fn int(&mut self) -> u32 {
        u32::try_from(i32::from_le_bytes(self.take())).expect("not negative")
    }

    fn long(&mut self) -> usize {
        usize::try_from(i64::from_le_bytes(self.take())).expect("not negative")
    }

    fn text(&mut self) -> String {
        let end = self.0.iter().position(|&byte| byte == 0).expect("a text ends");
        let text = String::from_utf8(self.0[..end].to_vec()).expect("UTF-8");
        self.0 = &self.0[end + 1..];
        text
    }
}

/// The next packet, without its length; `None` at the end.
fn packet(stream: &mut TcpStream) -> Option<Vec<u8>> {
    let mut length = [0; 4];
    stream.read_exact(&mut length).ok()?;
    let mut packet = vec![0; u32::from_le_bytes(length) as usize - 4];
    stream.read_exact(&mut packet).expect("a whole packet");
    Some(packet)
}

/// A viewer: what it shows in the end, and how many pixels it was sent.
fn view(mut stream: TcpStream) -> (Image, usize) {
    let created = packet(&mut stream).expect("a packet");
    let mut fields = Fields(&created);
    // CreateImage, in front.
    assert_eq!(fields.take(), [4, 1]);
    let name = fields.text();
    let (width, height, count) = (fields.int(), fields.int(), fields.int());
    let channels: Vec<String> = (0..count).map(|_| fields.text()).collect();
    assert_eq!(channels, ["R", "G", "B"]);
    assert!(name.contains("scene.toml") && fields.0.is_empty(), "{name}");
    let mut image = Image::new(width, height).expect("an image");
    let mut received = 0;
    while let Some(update) = packet(&mut stream) {
        let mut fields = Fields(&update);
        // UpdateImageV3.
        assert_eq!(fields.take(), [6, 0]);
        assert_eq!((fields.text(), fields.int()), (name.clone(), 3));
        let channels: Vec<String> = (0..3).map(|_| fields.text()).collect();
        let channel = |name: &String| ["R", "G", "B"].iter().position(|known| known == name);
        let channels: Vec<usize> = channels.iter().map(|name| channel(name).expect("a channel")).collect();
        let [x, y, columns, rows] = [0; 4].map(|_| fields.int());
        assert!(x + columns <= width && y + rows <= height);
        let offsets: Vec<usize> = (0..3).map(|_| fields.long()).collect();
        let strides: Vec<usize> = (0..3).map(|_| fields.long()).collect();
        let data: Vec<f32> =
            fields.0.as_chunks::<4>().0.iter().map(|value| f32::from_le_bytes(*value)).collect();
        for index in 0..columns * rows {
            let at = (y + index / columns) * width + x + index % columns;
            for ((&channel, offset), stride) in channels.iter().zip(&offsets).zip(&strides) {
                image.pixels_mut()[at as usize][channel] = data[offset + index as usize * stride];
            }
        }
        received += (columns * rows) as usize;
    }
    (image, received)
}

fn warnings(output: &Output) -> usize {
    String::from_utf8_lossy(&output.stderr).lines().filter(|line| line.starts_with("warning: ")).count()
}

/// A viewer that reads shows every pixel as it is written, whatever is rendered in several steps.
#[test]
fn a_viewer_shows_the_image_that_is_written() {
    let folder = folder();
    for flags in [&[][..], &["--steps", "2", "--integrator", "light-mesh"]] {
        let (listener, address) = server();
        let viewer = thread::spawn(move || view(listener.accept().expect("a connection").0));
        let flags = [flags, &["--display-server", &address]].concat();
        let (output, written) = render(folder.path(), "150x70", &flags);
        let (shown, received) = viewer.join().expect("the protocol is followed");
        let written = image::decode(&written).expect("an image");
        assert!(received >= 150 * 70);
        crate::common::failed::assert_same_bits(&shown, &written, format!("{flags:?}"));
        assert_eq!(warnings(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
    }
}

/// A viewer that closes after the first packet, one that never reads, and one that isn't there leave the image as it is, cost no more than a few
/// seconds, and are warned about once.
#[test]
fn a_viewer_that_goes_away_or_hangs_changes_nothing() {
    let folder = folder();
    // 7.5 MB: more than the system's buffers take.
    let size = "900x700";
    let (_, expected) = render(folder.path(), size, &[]);

    let (listener, address) = server();
    let closing = thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("a connection");
        assert!(packet(&mut stream).is_some());
    });
    let (output, found) = render(folder.path(), size, &["--display-server", &address]);
    closing.join().expect("it got a packet");
    assert!(found == expected, "a closed connection changes the image");
    assert_eq!(warnings(&output), 1, "{}", String::from_utf8_lossy(&output.stderr));

    // The system accepts the connection.
    let (hanging, address) = server();
    let start = Instant::now();
    let (output, found) = render(folder.path(), size, &["--display-server", &address]);
    let seconds = start.elapsed().as_secs();
    drop(hanging);
    assert!(found == expected, "a viewer that hangs changes the image");
    assert_eq!(warnings(&output), 1, "{}", String::from_utf8_lossy(&output.stderr));
    assert!(seconds < 60, "{seconds} s");

    let (listener, nobody) = server();
    drop(listener);
    let (_, expected) = render(folder.path(), "64x48", &[]);
    for server in [nobody.as_str(), "no such host", ""] {
        let (output, found) = render(folder.path(), "64x48", &["--display-server", server]);
        assert!(found == expected, "{server}");
        assert_eq!(warnings(&output), 1, "{}", String::from_utf8_lossy(&output.stderr));
    }
    let (output, _) = render(folder.path(), "16x16", &["--display-server", &nobody, "--quiet"]);
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}
