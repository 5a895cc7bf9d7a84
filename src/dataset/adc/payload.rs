//! The converter's bytes in a file: all of it, or what the packets of a DCA1000 carry; a `.pcap` or a capture that was written with
//! its headers.
//!
//! A data packet is a sequence number (u32), the number of bytes before it (6 bytes), and at most 1,456 bytes, all little endian,
//! from UDP port 4098. What no packet carries is 0, and counted.

use crate::dataset::DatasetError;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Bytes before a packet's payload.
const HEADER: usize = 10;
/// Bytes of payload at the most, in a packet and in a file that was written packet by packet.
const PAYLOAD: usize = 1456;
/// The port that data comes from.
const DATA_PORT: u16 = 4098;
/// Packets that are accepted: 48 bytes of memory each.
const MOST_PACKETS: usize = 8 << 20;
/// Bytes that may be lost, in multiples of those that are there.
const MOST_LOST: u64 = 16;
/// Bytes of a recorded frame on the wire that are accepted.
const MOST_RECORD: u32 = 1 << 18;

/// The converter's bytes of a capture.
#[derive(Debug)]
pub struct Payload {
    path: PathBuf,
    file: Mutex<File>,
    len: u64,
    /// Where the packets' payloads are; empty where the whole file is payload.
    packets: Vec<Packet>,
    gaps: Gaps,
}

/// A packet's payload.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Packet {
    /// Where in the signal.
    at: u64,
    /// Where in the file.
    from: u64,
    len: u32,
}

/// What was lost on the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Gaps {
    /// Bytes of the signal that no packet carries.
    pub bytes: u64,
    /// How many gaps they make.
    pub count: usize,
}

impl Payload {
    /// Opens a file; a `.pcap` and one with headers are read through once, to find their packets.
    ///
    /// # Errors
    /// Where it cannot be read, or a `.pcap` holds no data packet; naming the byte where it stops making sense.
    pub fn open(path: &Path) -> Result<Self, DatasetError> {
        let unreadable = |reason: io::Error| match reason.kind() {
            io::ErrorKind::NotFound => DatasetError::NotFound { path: path.to_owned() },
            _ => DatasetError::Read { reason, path: path.to_owned() },
        };
        let mut file = crate::input::open_file(path, "a capture").map_err(unreadable)?;
        let size = file.metadata().map_err(unreadable)?.len();
        let mut head = [0; 24];
        let known = read_some(&mut file, &mut head).map_err(unreadable)?;
        let head = head.get(..known).unwrap_or_default();
        let fault = |message: String| DatasetError::Frame { message, path: path.to_owned() };
        let packets = if let Some(form) = PcapForm::of(head) {
            pcap_packets(&mut file, form, size).map_err(unreadable)?.map_err(fault)?
        } else if let (Some(1), Some(0)) = (u32_at(head, 0, false), count_at(head, 4)) {
            headed_packets(&mut file, size).map_err(unreadable)?.unwrap_or_default()
        } else {
            Vec::new()
        };
        let (len, gaps) = if packets.is_empty() { (size, Gaps::default()) } else { extent(&packets) };
        // A damaged count would make a capture of hours out of a few packets.
        if gaps.bytes > MOST_LOST * size {
            let message = format!("its packets claim {len} bytes of samples, of which {} are there", len - gaps.bytes);
            return Err(fault(message));
        }
        Ok(Self { path: path.to_owned(), file: Mutex::new(file), len, packets, gaps })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes of the signal.
    pub fn len(&self) -> u64 {
        self.len
    }

    /// True without any.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// What was lost.
    pub fn gaps(&self) -> Gaps {
        self.gaps
    }

    /// Whether headers had to be taken off.
    pub fn is_packets(&self) -> bool {
        !self.packets.is_empty()
    }

    /// `len` bytes of the signal from `at`; 0 where no packet carries them, or past the end.
    ///
    /// # Errors
    /// Where the file cannot be read.
    pub fn read(&self, at: u64, len: usize) -> Result<Vec<u8>, DatasetError> {
        let mut bytes = vec![0; len];
        let end = at.saturating_add(len as u64).min(self.len);
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let mut fill = |from: u64, at_in: usize, count: usize| -> io::Result<()> {
            file.seek(SeekFrom::Start(from))?;
            file.read_exact(bytes.get_mut(at_in..at_in + count).unwrap_or_default())
        };
        let done = if self.packets.is_empty() {
            fill(at, 0, end.saturating_sub(at) as usize)
        } else {
            let first = self.packets.partition_point(|packet| packet.at + u64::from(packet.len) <= at);
            let inside = self.packets.get(first..).unwrap_or_default().iter().take_while(|packet| packet.at < end);
            inside.copied().try_for_each(|packet| {
                let (from, to) = (packet.at.max(at), (packet.at + u64::from(packet.len)).min(end));
                fill(packet.from + (from - packet.at), (from - at) as usize, to.saturating_sub(from) as usize)
            })
        };
        done.map_err(|reason| DatasetError::Read { reason, path: self.path.clone() })?;
        Ok(bytes)
    }
}

/// As much of `buffer` as there is.
fn read_some(file: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    let mut known = 0;
    while known < buffer.len() {
        match file.read(&mut buffer[known..])? {
            0 => break,
            n => known += n,
        }
    }
    Ok(known)
}

fn u16_at(bytes: &[u8], at: usize, big: bool) -> Option<u16> {
    let word: [u8; 2] = bytes.get(at..at + 2)?.try_into().ok()?;
    Some(if big { u16::from_be_bytes(word) } else { u16::from_le_bytes(word) })
}

fn u32_at(bytes: &[u8], at: usize, big: bool) -> Option<u32> {
    let word: [u8; 4] = bytes.get(at..at + 4)?.try_into().ok()?;
    Some(if big { u32::from_be_bytes(word) } else { u32::from_le_bytes(word) })
}

/// The six bytes that count the payload before a packet.
fn count_at(bytes: &[u8], at: usize) -> Option<u64> {
    let six = bytes.get(at..at + 6)?;
    Some(six.iter().rev().fold(0, |count, &byte| count << 8 | u64::from(byte)))
}

/// From the first byte to the last that any packet carries, and what lies between packets.
fn extent(packets: &[Packet]) -> (u64, Gaps) {
    let (mut end, mut gaps) = (0, Gaps::default());
    for packet in packets {
        if packet.at > end {
            gaps.bytes += packet.at - end;
            gaps.count += 1;
        }
        end = end.max(packet.at + u64::from(packet.len));
    }
    (end, gaps)
}

/// In the order of the signal, each byte of it once.
fn sorted(mut packets: Vec<Packet>) -> Vec<Packet> {
    packets.sort_unstable();
    let mut end = 0;
    for packet in &mut packets {
        // Sent twice, or partly: what is known already is left out.
        let known = end.max(packet.at) - packet.at;
        let known = known.min(u64::from(packet.len));
        packet.at += known;
        packet.from += known;
        packet.len -= known as u32;
        end = end.max(packet.at + u64::from(packet.len));
    }
    packets.retain(|packet| packet.len > 0);
    packets
}

/// The packets of a file that was written with their headers; `None` where it only looked like one.
fn headed_packets(file: &mut File, size: u64) -> io::Result<Option<Vec<Packet>>> {
    let stride = (HEADER + PAYLOAD) as u64;
    if size / stride >= MOST_PACKETS as u64 {
        return Ok(None);
    }
    let mut packets = Vec::new();
    let mut header = [0; HEADER];
    for (sequence, from) in (0..size).step_by(stride as usize).enumerate() {
        file.seek(SeekFrom::Start(from))?;
        if read_some(file, &mut header)? < HEADER {
            break;
        }
        let len = (size - from - HEADER as u64).min(PAYLOAD as u64) as u32;
        let (Some(number), Some(at)) = (u32_at(&header, 0, false), count_at(&header, 4)) else { return Ok(None) };
        // Packets may be missing, none may come early.
        if (number as usize) <= sequence || at > MOST_PACKETS as u64 * stride {
            return Ok(None);
        }
        packets.push(Packet { at, from: from + HEADER as u64, len });
    }
    Ok(Some(sorted(packets)))
}

/// How a `.pcap` writes its numbers.
#[derive(Clone, Copy)]
struct PcapForm {
    big: bool,
}

impl PcapForm {
    /// That of a file that begins so, where it is one: times in micro- or nanoseconds, either byte order.
    fn of(head: &[u8]) -> Option<Self> {
        let is = |big| matches!(u32_at(head, 0, big), Some(0xA1B2_C3D4 | 0xA1B2_3C4D));
        (head.len() == 24).then(|| [false, true].into_iter().find(|&big| is(big))).flatten().map(|big| Self { big })
    }
}

/// The data packets of a `.pcap` of Ethernet frames; or where it stops making sense.
fn pcap_packets(file: &mut File, form: PcapForm, size: u64) -> io::Result<Result<Vec<Packet>, String>> {
    let (mut packets, mut at) = (Vec::new(), 24_u64);
    let mut file = BufReader::new(file);
    file.seek(SeekFrom::Start(at))?;
    let mut frame = Vec::new();
    while at + 16 <= size {
        let mut record = [0; 16];
        file.read_exact(&mut record)?;
        let len = u32_at(&record, 8, form.big).unwrap_or(u32::MAX);
        if len > MOST_RECORD {
            return Ok(Err(format!("the record at byte {at} has {len} bytes; expected at most {MOST_RECORD}")));
        }
        at += 16;
        if at + u64::from(len) > size {
            // A capture that was stopped while it wrote.
            break;
        }
        frame.resize(len as usize, 0);
        file.read_exact(&mut frame)?;
        if let Some((from, data)) = udp_payload(&frame)
            && let Some(count) = count_at(data, 4)
            && data.len() > HEADER
        {
            if packets.len() >= MOST_PACKETS || count > MOST_PACKETS as u64 * PAYLOAD as u64 {
                return Ok(Err(format!("more packets than are accepted ({MOST_PACKETS}), at byte {at}")));
            }
            let (from, len) = (at + (from + HEADER) as u64, (data.len() - HEADER) as u32);
            packets.push(Packet { at: count, from, len });
        }
        at += u64::from(len);
    }
    if packets.is_empty() {
        return Ok(Err(format!("no packet from UDP port {DATA_PORT} in it; expected those of a DCA1000")));
    }
    Ok(Ok(sorted(packets)))
}

/// What a DCA1000 sent in an Ethernet frame, and where in the frame it begins.
fn udp_payload(frame: &[u8]) -> Option<(usize, &[u8])> {
    let mut at = 12;
    let mut kind = u16_at(frame, at, true)?;
    while kind == 0x8100 {
        at += 4;
        kind = u16_at(frame, at, true)?;
    }
    let ip = at + 2;
    let version = frame.get(ip)? >> 4;
    let (protocol, udp) = match (kind, version) {
        (0x0800, 4) => (*frame.get(ip + 9)?, ip + 4 * usize::from(frame.get(ip)? & 0xF)),
        _ => return None,
    };
    if protocol != 17 || ![u16_at(frame, udp, true)?, u16_at(frame, udp + 2, true)?].contains(&DATA_PORT) {
        return None;
    }
    let len = usize::from(u16_at(frame, udp + 4, true)?).checked_sub(8)?;
    Some((udp + 8, frame.get(udp + 8..udp + 8 + len)?))
}
