//! Reading the wanted frames of a video, in order, with as little work as the codec allows.

use std::collections::VecDeque;
use std::path::Path;

use ffmpeg_next::codec::{Parameters, decoder};
use ffmpeg_next::format::context::Input;
use ffmpeg_next::picture::Type;
use ffmpeg_next::{Packet, frame};

use super::decoder::{self as opening, Pool};
use super::picture::Picture;
use super::track::{Numbering, Track};
use super::{DecodeFault, VideoError, open_input};

/// A wanted frame on its way to a picture: still compressed, decoded, or lost.
/// [`Video::picture`](super::Video::picture) makes the picture of it, on any thread.
#[derive(Debug)]
pub struct Pending {
    number: u64,
    state: State,
}

#[derive(Debug)]
enum State {
    Coded(PacketBox),
    Decoded(Picture),
    Lost(DecodeFault),
}

/// A packet, which has no `Debug` of its own.
struct PacketBox(Packet);

impl std::fmt::Debug for PacketBox {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Packet({} bytes)", self.0.size())
    }
}

impl Pending {
    /// The frame's position in the video.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The frame's data, if it is still coded and stands alone.
    pub(super) fn coded(&self) -> Option<&[u8]> {
        match &self.state {
            State::Coded(packet) => packet.0.data(),
            State::Decoded(_) | State::Lost(_) => None,
        }
    }

    pub(super) fn decode(self, track: &Track, pool: &Pool) -> Result<Picture, DecodeFault> {
        match self.state {
            State::Coded(packet) => track.picture(self.number, pool.decode(&packet.0)?),
            State::Decoded(picture) => Ok(picture),
            State::Lost(fault) => Err(fault),
        }
    }
}

/// Returns the wanted frames of a [`Video`](super::Video). Every wanted frame comes exactly once, in order of
/// presentation; lost ones may come last.
pub struct Reader<'a> {
    track: &'a Track,
    input: Input,
    /// Packets of the track read so far.
    packets: usize,
    wanted: Wanted,
    /// The decoder, if frames depend on each other.
    chain: Option<Chain>,
    /// Only frames that depend on no other are wanted, and the time stamps tell which ones come.
    keys_only: bool,
    ready: VecDeque<Pending>,
    ended: bool,
}

impl<'a> Reader<'a> {
    pub(super) fn open(
        path: &Path,
        codec: &str,
        track: &'a Track,
        wanted: &[u64],
        threads: usize,
    ) -> Result<Self, VideoError> {
        let input = open_input(path)?;
        let stream = input
            .stream(track.stream)
            .ok_or_else(|| VideoError::no_video(path))?;
        let chain = if opening::frames_stand_alone(track.codec) {
            None
        } else {
            let chain = Chain::open(stream.parameters(), threads);
            Some(chain.map_err(VideoError::decoder(path, codec))?)
        };
        let is_key = |number: &u64| track.is_key(*number);
        Ok(Self {
            keys_only: track.stamps_are_unique() && wanted.iter().all(is_key),
            track,
            input,
            packets: 0,
            wanted: Wanted::new(wanted),
            chain,
            ready: VecDeque::new(),
            ended: false,
        })
    }

    /// Reads the next packet, or notes the end of the file.
    fn advance(&mut self) {
        // A packet that is read into again would keep the memory of what it held.
        let mut packet = Packet::empty();
        match packet.read(&mut self.input) {
            Ok(()) if packet.stream() == self.track.stream && packet.size() > 0 => {
                self.take_packet(packet);
            }
            Ok(()) => {}
            Err(_) => self.end(),
        }
    }

    fn take_packet(&mut self, packet: Packet) {
        let track = self.track;
        let number = track.number_of_packet.get(self.packets).copied().flatten();
        self.packets += 1;
        match &mut self.chain {
            // The container's flag of a key frame can also mean a recovery point.
            Some(_) if self.keys_only && !number.is_some_and(|number| track.is_key(number)) => {}
            Some(chain) => chain.feed(&packet, track, &mut self.wanted, &mut self.ready),
            None => {
                if let Some(number) = number.filter(|&number| self.wanted.take(number)) {
                    let state = State::Coded(PacketBox(packet));
                    self.ready.push_back(Pending { number, state });
                }
            }
        }
    }

    fn end(&mut self) {
        self.ended = true;
        if let Some(chain) = &mut self.chain {
            chain.flush(self.track, &mut self.wanted, &mut self.ready);
        }
        // In a file that was decoded to count its frames, packets have no numbers.
        let fault = if self.packets < self.track.number_of_packet.len() {
            DecodeFault::Unread
        } else {
            DecodeFault::no_picture()
        };
        for number in self.wanted.rest() {
            self.ready.push_back(Pending {
                number,
                state: State::Lost(fault.clone()),
            });
        }
    }
}

impl Iterator for Reader<'_> {
    type Item = Pending;

    fn next(&mut self) -> Option<Pending> {
        loop {
            if let Some(pending) = self.ready.pop_front() {
                return Some(pending);
            }
            if self.ended {
                return None;
            }
            self.advance();
            // Nothing more is wanted: the rest of the file is not read.
            if self.wanted.is_empty() && !self.ended {
                self.ended = true;
            }
        }
    }
}

/// The numbers that are still wanted.
struct Wanted {
    sorted: Vec<u64>,
    taken: Vec<bool>,
    left: usize,
}

impl Wanted {
    fn new(numbers: &[u64]) -> Self {
        let mut sorted = numbers.to_vec();
        sorted.sort_unstable();
        sorted.dedup();
        Self {
            taken: vec![false; sorted.len()],
            left: sorted.len(),
            sorted,
        }
    }

    /// True the first time that a wanted number comes.
    fn take(&mut self, number: u64) -> bool {
        match self.sorted.binary_search(&number) {
            Ok(at) if !self.taken[at] => {
                self.taken[at] = true;
                self.left -= 1;
                true
            }
            _ => false,
        }
    }

    fn is_empty(&self) -> bool {
        self.left == 0
    }

    fn rest(&mut self) -> Vec<u64> {
        let open = self
            .sorted
            .iter()
            .zip(&self.taken)
            .filter(|(_, taken)| !**taken);
        let rest = open.map(|(&number, _)| number).collect();
        self.taken.fill(true);
        self.left = 0;
        rest
    }
}

/// A decoder of frames that build on each other.
struct Chain {
    decoder: decoder::Video,
    /// One more than the number of the last frame that the decoder returned.
    given: u64,
    /// The damaged frame on which those up to the next key frame may depend.
    broken_by: Option<u64>,
}

impl Chain {
    fn open(parameters: Parameters, threads: usize) -> Result<Self, ffmpeg_next::Error> {
        let decoder = opening::open(parameters, threads)?;
        Ok(Self {
            decoder,
            given: 0,
            broken_by: None,
        })
    }

    /// An error here may belong to a packet that another thread is still decoding. Which frames are
    /// damaged shows in what the decoder returns.
    fn feed(
        &mut self,
        packet: &Packet,
        track: &Track,
        wanted: &mut Wanted,
        ready: &mut VecDeque<Pending>,
    ) {
        let _ = self.decoder.send_packet(packet);
        self.drain(track, wanted, ready);
    }

    fn flush(&mut self, track: &Track, wanted: &mut Wanted, ready: &mut VecDeque<Pending>) {
        if self.decoder.send_eof().is_ok() {
            self.drain(track, wanted, ready);
        }
    }

    fn drain(&mut self, track: &Track, wanted: &mut Wanted, ready: &mut VecDeque<Pending>) {
        let mut errors = 0;
        loop {
            let mut picture = frame::Video::empty();
            match self.decoder.receive_frame(&mut picture) {
                Ok(()) => self.accept(picture, track, wanted, ready),
                // With threads, a damaged packet is reported here, and the frames after it follow.
                // The limit ends the loop: no decoder holds back more packets than this.
                Err(ffmpeg_next::Error::InvalidData) if errors < 64 => errors += 1,
                Err(_) => return,
            }
        }
    }

    fn accept(
        &mut self,
        picture: frame::Video,
        track: &Track,
        wanted: &mut Wanted,
        ready: &mut VecDeque<Pending>,
    ) {
        let stamp = picture.timestamp().or_else(|| picture.pts());
        let Some(number) = track.number_of(stamp, self.given) else {
            return;
        };
        let fault = match &track.numbering {
            Numbering::Decoder(faults) => {
                faults.get(&number).cloned().or_else(|| concealed(&picture))
            }
            numbering => {
                // Frames come in order of presentation: skipped numbers were lost.
                if number > self.given {
                    self.broken_by = self.broken_by.or(Some(self.given));
                }
                // Without time stamps the numbers after a lost frame would be a guess.
                let known = matches!(numbering, Numbering::Stamps) || self.broken_by.is_none();
                fault_of(&picture, number, known, &mut self.broken_by)
            }
        };
        self.given = number + 1;
        if let Some(fault) = fault {
            return lose(number, fault, wanted, ready);
        }
        if wanted.take(number) {
            let state = match track.picture(number, picture) {
                Ok(picture) => State::Decoded(picture),
                Err(fault) => State::Lost(fault),
            };
            ready.push_back(Pending { number, state });
        }
    }
}

fn lose(number: u64, fault: DecodeFault, wanted: &mut Wanted, ready: &mut VecDeque<Pending>) {
    if wanted.take(number) {
        let state = State::Lost(fault);
        ready.push_back(Pending { number, state });
    }
}

/// What is wrong with a decoded picture, by itself or by what it builds on. `restart`: whether a key frame ends the damage
/// before it.
pub(super) fn fault_of(
    picture: &frame::Video,
    number: u64,
    restart: bool,
    broken_by: &mut Option<u64>,
) -> Option<DecodeFault> {
    // A recovery point without a whole intra picture is marked as key, too; the pictures after it are only complete
    // later.
    let is_predicted = matches!(picture.kind(), Type::P | Type::B);
    if restart && picture.is_key() && !is_predicted {
        *broken_by = None;
    }
    let fault = concealed(picture);
    if fault.is_some() {
        *broken_by = broken_by.or(Some(number));
        return fault;
    }
    broken_by.map(|frame| DecodeFault::Unusable(format!("it builds on the damaged frame {frame}")))
}

/// Whether the decoder covered up missing parts.
fn concealed(picture: &frame::Video) -> Option<DecodeFault> {
    let covered = picture.is_corrupt() || picture.has_decode_errors();
    covered.then(DecodeFault::concealed)
}
