//! Live display: a picture appears in a viewer that speaks the protocol of tev while it is rendered.
//!
//! Tiles are copied into a picture that a thread of its own sends from, so that nobody waits for the viewer: whatever it does, the render takes a
//! memory copy per tile. What waits to be sent is at most the whole picture, since a newer tile takes the place of an older one.

use std::collections::{HashSet, VecDeque};
use std::io;
use std::net::{TcpStream, ToSocketAddrs as _};
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

use super::error::describe;
use super::progress::Reporter;
use super::shared::QuietArgs;
use crate::image::Image;
use crate::render::{Tile, TileSink};

/// A viewer that takes nothing for this time is given up.
const STALL: Duration = Duration::from_secs(1);
/// After the render the viewer has this time to take what is left.
const LAST_TILES: Duration = Duration::from_secs(10);
/// Edge of the parts of a finished picture that are compared with what was sent.
const EDGE: u32 = 32;
const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// Shows tiles in a viewer, if one was asked for.
pub struct LiveDisplay {
    viewer: Option<Viewer>,
}

/// The render's end of the connection.
struct Viewer {
    shared: Arc<Shared>,
    server: String,
    reporter: Reporter,
}

impl LiveDisplay {
    /// Opens the display of a picture of a scene file at `server`, HOST:PORT, if there is one. What goes wrong is a warning, later.
    pub fn new(server: Option<&str>, scene: &Path, resolution: (u32, u32), quiet: QuietArgs) -> Self {
        // The protocol ends names with a zero.
        let name = scene.display().to_string().replace('\0', " ");
        Self { viewer: server.map(|server| Viewer::new(server, name, resolution, quiet)) }
    }

    /// Waits until the viewer has all of the picture, unless it takes too long.
    pub fn finish(self) {
        let Some(Viewer { shared, server, reporter }) = self.viewer else { return };
        let mut picture = shared.lock();
        picture.finished = true;
        shared.changed.notify_all();
        let sending = |picture: &mut Picture| !picture.ended;
        let waited = shared.changed.wait_timeout_while(picture, LAST_TILES, sending);
        drop(waited);
        if shared.give_up() {
            reporter.line(&format!("warning: {server}: the viewer is too slow to be shown all of the image"));
        }
    }
}

impl TileSink for LiveDisplay {
    fn tile(&self, tile: &Tile, pixels: &[[f32; 3]]) {
        if let Some(viewer) = &self.viewer {
            viewer.shared.lock().show(tile, pixels);
            viewer.shared.changed.notify_all();
        }
    }

    fn picture(&self, image: &Image) {
        if let Some(viewer) = &self.viewer {
            viewer.shared.show_whole(image);
        }
    }
}

impl Viewer {
    fn new(server: &str, name: String, resolution: (u32, u32), quiet: QuietArgs) -> Self {
        let picture = Picture::new(resolution);
        let shared = Arc::new(Shared { picture: Mutex::new(picture), changed: Condvar::new() });
        let (to_send, address, reporter) = (shared.clone(), server.to_owned(), quiet.reporter());
        let started = thread::Builder::new().name("live display".to_owned()).spawn(move || {
            if let Err(error) = send(&to_send, &address, &name, resolution) {
                to_send.give_up();
                reporter.line(&format!("warning: {address}: nothing is displayed: {}", reason(&error)));
            }
            to_send.give_up();
        });
        let viewer = Self { shared, server: server.to_owned(), reporter: quiet.reporter() };
        if let Err(error) = started {
            viewer.shared.give_up();
            viewer.reporter.line(&format!("warning: {server}: nothing is displayed: {}", reason(&error)));
        }
        viewer
    }
}

/// In words, where the system's are about something else.
fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => "the viewer does not react".to_owned(),
        _ => describe(error),
    }
}

/// What the render and the thread that sends share.
struct Shared {
    picture: Mutex<Picture>,
    /// There is something to send, or nothing will be any more.
    changed: Condvar,
}

/// The picture as it is to be shown.
struct Picture {
    width: u32,
    height: u32,
    /// Empty when the viewer has gone.
    pixels: Vec<[f32; 3]>,
    /// Tiles that were not sent yet, in order, and their corners.
    waiting: VecDeque<Tile>,
    corners: HashSet<(u32, u32)>,
    /// No tiles will come any more.
    finished: bool,
    /// Nothing is sent any more.
    ended: bool,
}

impl Shared {
    /// A thread that panicked leaves a picture that is as good as any.
    fn lock(&self) -> MutexGuard<'_, Picture> {
        self.picture.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends nothing any more, and frees the memory. Returns whether that was not so before.
    fn give_up(&self) -> bool {
        let mut picture = self.lock();
        (picture.pixels, picture.waiting, picture.corners) = Default::default();
        picture.finished = true;
        self.changed.notify_all();
        !std::mem::replace(&mut picture.ended, true)
    }

    /// Shows what of a finished picture is not shown yet: it may be one from before the last tiles.
    fn show_whole(&self, image: &Image) {
        let rows = (0..image.height()).step_by(EDGE as usize);
        let corners = rows.flat_map(|y| (0..image.width()).step_by(EDGE as usize).map(move |x| (x, y)));
        for (x, y) in corners {
            let (width, height) = (EDGE.min(image.width() - x), EDGE.min(image.height() - y));
            let tile = Tile { x, y, width, height };
            let pixels = tile_of(image.pixels(), image.width(), &tile);
            let mut picture = self.lock();
            let bits = |pixels: &[[f32; 3]]| -> Vec<u32> {
                pixels.iter().flatten().map(|value| value.to_bits()).collect()
            };
            if bits(&picture.tile(&tile)) != bits(&pixels) {
                picture.show(&tile, &pixels);
            }
        }
        self.changed.notify_all();
    }

    /// The next tile to send; waits for one. `None` when there will be none.
    fn next(&self) -> Option<(Tile, Vec<[f32; 3]>)> {
        let mut picture = self.lock();
        loop {
            if let Some(tile) = picture.waiting.pop_front() {
                picture.corners.remove(&(tile.x, tile.y));
                let pixels = picture.tile(&tile);
                return Some((tile, pixels));
            }
            if picture.finished {
                return None;
            }
            picture = self.changed.wait(picture).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Picture {
    fn new((width, height): (u32, u32)) -> Self {
        let pixels = vec![[0.0; 3]; width as usize * height as usize];
        let (waiting, corners) = Default::default();
        Self { width, height, pixels, waiting, corners, finished: false, ended: false }
    }

    /// Puts a tile in its place, to be sent.
    fn show(&mut self, tile: &Tile, pixels: &[[f32; 3]]) {
        let fits = tile.x + tile.width <= self.width && tile.y + tile.height <= self.height;
        if self.pixels.is_empty() || !fits || tile.pixels() == 0 {
            return;
        }
        let (width, left) = (self.width as usize, tile.x as usize);
        let rows = self.pixels.chunks_exact_mut(width).skip(tile.y as usize);
        for (row, new) in rows.zip(pixels.chunks_exact(tile.width as usize)) {
            row[left..left + new.len()].copy_from_slice(new);
        }
        if self.corners.insert((tile.x, tile.y)) {
            self.waiting.push_back(*tile);
        }
    }

    /// The pixels of a tile as they are; none when the viewer has gone.
    fn tile(&self, tile: &Tile) -> Vec<[f32; 3]> {
        tile_of(&self.pixels, self.width, tile)
    }
}

/// The pixels of a tile of an image of some width.
fn tile_of(pixels: &[[f32; 3]], width: u32, tile: &Tile) -> Vec<[f32; 3]> {
    let rows = pixels.chunks_exact(width as usize).skip(tile.y as usize).take(tile.height as usize);
    rows.flat_map(|row| row.iter().skip(tile.x as usize).take(tile.width as usize)).copied().collect()
}

/// Sends tiles to a viewer until there are no more.
fn send(shared: &Shared, server: &str, name: &str, (width, height): (u32, u32)) -> io::Result<()> {
    let stream = connect(server)?;
    stream.set_write_timeout(Some(STALL))?;
    let mut client = TevClient::wrap(stream);
    client.send(PacketCreateImage {
        image_name: name,
        grab_focus: true,
        width,
        height,
        channel_names: &CHANNELS,
    })?;
    while let Some((tile, pixels)) = shared.next() {
        let data = pixels.as_flattened();
        // Given up meanwhile.
        if data.is_empty() {
            break;
        }
        client.send(PacketUpdateImage {
            image_name: name,
            grab_focus: false,
            channel_names: &CHANNELS,
            channel_offsets: &[0, 1, 2],
            channel_strides: &[3, 3, 3],
            x: tile.x,
            y: tile.y,
            width: tile.width,
            height: tile.height,
            data,
        })?;
    }
    Ok(())
}

fn connect(server: &str) -> io::Result<TcpStream> {
    let mut last = io::Error::new(io::ErrorKind::NotFound, "no such host");
    for address in server.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, STALL) {
            Ok(stream) => return Ok(stream),
            Err(error) => last = error,
        }
    }
    Err(last)
}
