//! The container: records, a chunk for each frame, and the index at the end.
//!
//! Source: the MCAP specification (mcap.dev/spec), version 0. Chunks are not compressed, and the
//! checksums of the data section and the summary are left out, which 0 says.

use std::collections::BTreeMap;

use crate::{Error, FileStream};

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
const HEADER: u8 = 0x01;
const FOOTER: u8 = 0x02;
const SCHEMA: u8 = 0x03;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const CHUNK: u8 = 0x06;
const MESSAGE_INDEX: u8 = 0x07;
const CHUNK_INDEX: u8 = 0x08;
const STATISTICS: u8 = 0x0B;
const SUMMARY_OFFSET: u8 = 0x0E;
const DATA_END: u8 = 0x0F;

/// A topic.
pub(super) struct Channel {
    pub(super) topic: String,
    /// Where its schema stands among all schemas.
    pub(super) schema: usize,
    /// What a subscriber is told, YAML.
    pub(super) qos: String,
}

/// A message of a chunk.
pub(super) struct Message {
    /// Where its channel stands among all channels.
    pub(super) channel: usize,
    pub(super) time_ns: u64,
    pub(super) data: Vec<u8>,
}

/// A file that is being written.
pub(super) struct Container<'a> {
    out: &'a mut FileStream,
    schemas: Vec<(&'static str, String)>,
    channels: Vec<Channel>,
    /// Messages of each channel so far.
    counts: BTreeMap<u16, u64>,
    /// The contents of the chunk index records.
    index: Vec<Vec<u8>>,
    span: Option<(u64, u64)>,
}

impl<'a> Container<'a> {
    /// Begins a file of these schemas (name and text) and channels.
    pub(super) fn begin(
        out: &'a mut FileStream,
        schemas: Vec<(&'static str, String)>,
        channels: Vec<Channel>,
    ) -> Result<Self, Error> {
        out.put(MAGIC)?;
        let mut content = Vec::new();
        text(&mut content, "ros2");
        text(
            &mut content,
            concat!("nemoral-convert ", env!("CARGO_PKG_VERSION")),
        );
        put_record(out, HEADER, &content)?;
        let counts = (1..=channels.len() as u16).map(|id| (id, 0)).collect();
        Ok(Self {
            out,
            schemas,
            channels,
            counts,
            index: Vec::new(),
            span: None,
        })
    }

    /// Writes messages, in order of their time, as one chunk; schemas and channels are in the
    /// first.
    pub(super) fn chunk(&mut self, messages: &[Message]) -> Result<(), Error> {
        let (Some(first), Some(last)) = (messages.first(), messages.last()) else {
            return Ok(());
        };
        let (start, end) = (first.time_ns, last.time_ns);
        let mut records = Vec::new();
        if self.index.is_empty() {
            for (code, content) in self.definitions() {
                record(&mut records, code, &content);
            }
        }
        let mut offsets: BTreeMap<u16, Vec<u8>> = BTreeMap::new();
        for message in messages {
            let id = message.channel as u16 + 1;
            let entry = offsets.entry(id).or_default();
            u64(entry, message.time_ns);
            u64(entry, records.len() as u64);
            let count = self.counts.entry(id).or_default();
            let mut content = Vec::with_capacity(message.data.len() + 22);
            u16(&mut content, id);
            u32(&mut content, *count as u32);
            u64(&mut content, message.time_ns);
            u64(&mut content, message.time_ns);
            content.extend_from_slice(&message.data);
            record(&mut records, MESSAGE, &content);
            *count += 1;
        }
        let at = self.out.position();
        let mut content = Vec::with_capacity(records.len() + 40);
        u64(&mut content, start);
        u64(&mut content, end);
        u64(&mut content, records.len() as u64);
        u32(&mut content, crc32fast::hash(&records));
        text(&mut content, "");
        u64(&mut content, records.len() as u64);
        content.extend_from_slice(&records);
        put_record(self.out, CHUNK, &content)?;
        let after = self.out.position();
        let mut places = Vec::new();
        for (id, entries) in offsets {
            u16(&mut places, id);
            u64(&mut places, self.out.position());
            let mut content = Vec::new();
            u16(&mut content, id);
            u32(&mut content, entries.len() as u32);
            content.extend_from_slice(&entries);
            put_record(self.out, MESSAGE_INDEX, &content)?;
        }
        let mut content = Vec::new();
        for value in [start, end, at, after - at] {
            u64(&mut content, value);
        }
        u32(&mut content, places.len() as u32);
        content.extend_from_slice(&places);
        u64(&mut content, self.out.position() - after);
        text(&mut content, "");
        u64(&mut content, records.len() as u64);
        u64(&mut content, records.len() as u64);
        self.index.push(content);
        let (low, high) = self.span.unwrap_or((start, end));
        self.span = Some((low.min(start), high.max(end)));
        Ok(())
    }

    /// Writes the summary.
    pub(super) fn finish(self) -> Result<(), Error> {
        let mut zero = Vec::new();
        u32(&mut zero, 0);
        put_record(self.out, DATA_END, &zero)?;
        let start = self.out.position();
        let mut groups = Vec::new();
        let definitions = self.definitions();
        let statistics = vec![(STATISTICS, self.statistics())];
        let index = self.index.into_iter().map(|content| (CHUNK_INDEX, content));
        let of = |code: u8| {
            definitions
                .iter()
                .filter(move |d| d.0 == code)
                .cloned()
                .collect()
        };
        let all: [Vec<(u8, Vec<u8>)>; 4] = [of(SCHEMA), of(CHANNEL), statistics, index.collect()];
        for group in all {
            let Some(&(code, _)) = group.first() else {
                continue;
            };
            let at = self.out.position();
            for (code, content) in &group {
                put_record(self.out, *code, content)?;
            }
            groups.push((code, at, self.out.position() - at));
        }
        let offsets = self.out.position();
        for (code, at, length) in groups {
            let mut content = vec![code];
            u64(&mut content, at);
            u64(&mut content, length);
            put_record(self.out, SUMMARY_OFFSET, &content)?;
        }
        let mut content = Vec::new();
        u64(&mut content, start);
        u64(&mut content, offsets);
        u32(&mut content, 0);
        put_record(self.out, FOOTER, &content)?;
        self.out.put(MAGIC)
    }

    /// The records of schemas and channels, which are numbered from 1.
    fn definitions(&self) -> Vec<(u8, Vec<u8>)> {
        let mut records = Vec::new();
        for (id, (name, definition)) in (1..).zip(&self.schemas) {
            let mut content = Vec::new();
            u16(&mut content, id);
            text(&mut content, name);
            text(&mut content, "ros2msg");
            text(&mut content, definition);
            records.push((SCHEMA, content));
        }
        for (id, channel) in (1..).zip(&self.channels) {
            let mut content = Vec::new();
            u16(&mut content, id);
            u16(&mut content, channel.schema as u16 + 1);
            text(&mut content, &channel.topic);
            text(&mut content, "cdr");
            let mut metadata = Vec::new();
            text(&mut metadata, "offered_qos_profiles");
            text(&mut metadata, &channel.qos);
            u32(&mut content, metadata.len() as u32);
            content.extend_from_slice(&metadata);
            records.push((CHANNEL, content));
        }
        records
    }

    fn statistics(&self) -> Vec<u8> {
        let (start, end) = self.span.unwrap_or((0, 0));
        let mut content = Vec::new();
        u64(&mut content, self.counts.values().sum());
        u16(&mut content, self.schemas.len() as u16);
        u32(&mut content, self.channels.len() as u32);
        // Neither attachments nor metadata.
        u32(&mut content, 0);
        u32(&mut content, 0);
        u32(&mut content, self.index.len() as u32);
        u64(&mut content, start);
        u64(&mut content, end);
        u32(&mut content, 10 * self.counts.len() as u32);
        for (&id, &count) in &self.counts {
            u16(&mut content, id);
            u64(&mut content, count);
        }
        content
    }
}

fn record(out: &mut Vec<u8>, code: u8, content: &[u8]) {
    out.push(code);
    u64(out, content.len() as u64);
    out.extend_from_slice(content);
}

fn put_record(out: &mut FileStream, code: u8, content: &[u8]) -> Result<(), Error> {
    out.put([code])?;
    out.put((content.len() as u64).to_le_bytes())?;
    out.put(content)
}

fn u16(out: &mut Vec<u8>, value: u16) {
    out.extend_from_slice(&value.to_le_bytes());
}

fn u32(out: &mut Vec<u8>, value: u32) {
    out.extend_from_slice(&value.to_le_bytes());
}

fn u64(out: &mut Vec<u8>, value: u64) {
    out.extend_from_slice(&value.to_le_bytes());
}

fn text(out: &mut Vec<u8>, text: &str) {
    u32(out, text.len() as u32);
    out.extend_from_slice(text.as_bytes());
}
