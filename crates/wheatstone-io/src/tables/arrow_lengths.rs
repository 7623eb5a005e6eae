//! Lengths that an Arrow file says of its parts, before memory is taken for them.
//!
//! Source: the Apache Arrow specification, "Columnar format", serialisation and inter-process communication.

use super::cells::Foreign;
use arrow_ipc::{Message, RecordBatch, root_as_footer, root_as_message};
use std::{
    io::{Read, Seek, SeekFrom},
    ops::Range,
};
use wheatstone_core::limits;

/// Rows of a batch, at most.
const MOST_ROWS: i64 = 1 << 27;

/// Marks the beginning of a message.
const MARK: [u8; 4] = [0xFF; 4];

/// Refuses parts that are longer than the file, and columns that would not fit into memory. What is wrong
/// otherwise is left to the reader.
pub(super) fn check(file: &mut (impl Read + Seek), stream: bool) -> Result<(), Foreign> {
    let size = file.seek(SeekFrom::End(0))?;
    if stream { check_stream(file, size) } else { check_file(file, size) }
}

fn check_stream(file: &mut (impl Read + Seek), size: u64) -> Result<(), Foreign> {
    let mut place = 0;
    while place + 4 <= size {
        file.seek(SeekFrom::Start(place))?;
        let mut word: [u8; 4] = bytes(file)?;
        place += 4;
        if word == MARK {
            if place + 4 > size {
                return Ok(());
            }
            word = bytes(file)?;
            place += 4;
        }
        let length = u64::from(u32::from_le_bytes(word));
        if length == 0 {
            return Ok(());
        }
        let metadata = part(file, (place, length), size)?;
        let Ok(message) = root_as_message(&metadata) else { return Ok(()) };
        place += length;
        let body = place..place.saturating_add(u64::try_from(message.bodyLength())?);
        check_message(file, message, &body, size)?;
        place = body.end;
    }
    Ok(())
}

fn check_file(file: &mut (impl Read + Seek), size: u64) -> Result<(), Foreign> {
    // The footer's length, and the magic word.
    let Some(end) = size.checked_sub(10) else { return Ok(()) };
    file.seek(SeekFrom::Start(end))?;
    let length = u64::from(u32::from_le_bytes(bytes(file)?));
    let begin = end.checked_sub(length).ok_or(TOO_LONG)?;
    let footer = part(file, (begin, length), size)?;
    let Ok(footer) = root_as_footer(&footer) else { return Ok(()) };
    let blocks = footer.dictionaries().into_iter().chain(footer.recordBatches()).flatten();
    for block in blocks {
        let begin = u64::try_from(block.offset())?;
        let length = u64::try_from(block.metaDataLength())?;
        let metadata = part(file, (begin, length), size)?;
        let body = begin + length;
        let body = body..body.saturating_add(u64::try_from(block.bodyLength())?);
        let skipped = if metadata.starts_with(&MARK) { 8 } else { 4 };
        let Some(Ok(message)) = metadata.get(skipped..).map(root_as_message) else { return Ok(()) };
        check_message(file, message, &body, size)?;
    }
    Ok(())
}

/// A message whose body lies there in a file of this size.
fn check_message(
    file: &mut (impl Read + Seek),
    message: Message,
    body: &Range<u64>,
    size: u64,
) -> Result<(), Foreign> {
    within(body.start, body.end - body.start, size)?;
    let batch = message.header_as_record_batch();
    match batch.or_else(|| message.header_as_dictionary_batch()?.data()) {
        Some(batch) => check_batch(file, batch, body),
        None => Ok(()),
    }
}

fn check_batch(
    file: &mut (impl Read + Seek),
    batch: RecordBatch,
    body: &Range<u64>,
) -> Result<(), Foreign> {
    let nodes = batch.nodes().into_iter().flatten().map(|node| node.length());
    if nodes.chain([batch.length()]).any(|length| !(0..=MOST_ROWS).contains(&length)) {
        return Err("more rows in a batch than are read".into());
    }
    for buffer in batch.buffers().into_iter().flatten() {
        let (offset, length) = (u64::try_from(buffer.offset())?, u64::try_from(buffer.length())?);
        within(offset, length, body.end - body.start)?;
        if batch.compression().is_some() && length >= 8 {
            file.seek(SeekFrom::Start(body.start + offset))?;
            // What is packed begins with its length as unpacked; less than nothing says that it is not packed.
            let unpacked = i64::from_le_bytes(bytes(file)?);
            if u64::try_from(unpacked).is_ok_and(|unpacked| unpacked > limits::PART_BYTES.most()) {
                return Err(limits::PART_BYTES.exceeded().into());
            }
        }
    }
    Ok(())
}

const TOO_LONG: &str = "a part of it is longer than the file";

fn within(begin: u64, length: u64, size: u64) -> Result<(), Foreign> {
    begin.checked_add(length).filter(|end| *end <= size).map(drop).ok_or_else(|| TOO_LONG.into())
}

/// So many bytes from a place on.
fn part(
    file: &mut (impl Read + Seek),
    (begin, length): (u64, u64),
    size: u64,
) -> Result<Vec<u8>, Foreign> {
    within(begin, length, size)?;
    file.seek(SeekFrom::Start(begin))?;
    let mut part = vec![0; usize::try_from(length)?];
    file.read_exact(&mut part)?;
    Ok(part)
}

fn bytes<const N: usize>(file: &mut impl Read) -> Result<[u8; N], Foreign> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}
