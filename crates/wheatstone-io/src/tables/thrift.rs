//! Thrift's compact protocol, in which the footer and the page headers of a Parquet file are written, walked through
//! without taking memory; and what the format says of their fields.
//!
//! Source: the Apache Parquet format; the Thrift compact protocol's encoding.

/// Structures within each other, in a footer, at most.
const DEEPEST: usize = 32;

/// Fields of a structure by their numbers; others are passed over.
pub(super) type Fields = &'static [(i64, Type)];

/// What the format says that a field holds.
#[derive(Clone, Copy)]
pub(super) enum Type {
    Truth,
    Byte,
    /// Of 16, 32 or 64 bits, all written alike; enumerations too.
    Whole,
    Double,
    Text,
    List(&'static Type),
    Structure(Fields),
    /// One of several structures.
    Union(Fields),
}

use Type::{Byte, Double, List, Structure, Text, Truth, Union, Whole};

pub(super) const FOOTER: Fields = &[
    (1, Whole),
    (2, List(&Structure(SCHEMA_ELEMENT))),
    (3, Whole),
    (4, List(&Structure(ROW_GROUP))),
    (5, List(&Structure(KEY_VALUE))),
    (6, Text),
    (7, List(&Union(&[]))),
    (9, Text),
];
const SCHEMA_ELEMENT: Fields = &[
    (1, Whole),
    (2, Whole),
    (3, Whole),
    (4, Text),
    (5, Whole),
    (6, Whole),
    (7, Whole),
    (8, Whole),
    (9, Whole),
    (10, Union(LOGICAL_TYPE)),
];
const LOGICAL_TYPE: Fields = &[
    (5, Structure(&[(1, Whole), (2, Whole)])),
    (7, Structure(TIME)),
    (8, Structure(TIME)),
    (10, Structure(&[(1, Byte), (2, Truth)])),
    (16, Structure(&[(1, Byte)])),
    (17, Structure(&[(1, Text)])),
    (18, Structure(&[(1, Text), (2, Whole)])),
];
const TIME: Fields = &[(1, Truth), (2, Union(&[]))];
const KEY_VALUE: Fields = &[(1, Text), (2, Text)];
const ROW_GROUP: Fields = &[
    (1, List(&Structure(COLUMN))),
    (2, Whole),
    (3, Whole),
    (4, List(&Structure(&[(1, Whole), (2, Truth), (3, Truth)]))),
    (5, Whole),
    (6, Whole),
    (7, Whole),
];
const COLUMN: Fields = &[
    (1, Text),
    (2, Whole),
    (3, Structure(COLUMN_METADATA)),
    (4, Whole),
    (5, Whole),
    (6, Whole),
    (7, Whole),
];
const COLUMN_METADATA: Fields = &[
    (1, Whole),
    (2, List(&Whole)),
    (3, List(&Text)),
    (4, Whole),
    (5, Whole),
    (6, Whole),
    (7, Whole),
    (8, List(&Structure(KEY_VALUE))),
    (9, Whole),
    (10, Whole),
    (11, Whole),
    (12, Structure(STATISTICS)),
    (13, List(&Structure(&[(1, Whole), (2, Whole), (3, Whole)]))),
    (14, Whole),
    (15, Whole),
    (16, Structure(&[(1, Whole), (2, List(&Whole)), (3, List(&Whole))])),
    (17, Structure(&[(1, Structure(BOX)), (2, List(&Whole))])),
];
const STATISTICS: Fields =
    &[(1, Text), (2, Text), (3, Whole), (4, Whole), (5, Text), (6, Text), (7, Truth), (8, Truth)];
const BOX: Fields = &[
    (1, Double),
    (2, Double),
    (3, Double),
    (4, Double),
    (5, Double),
    (6, Double),
    (7, Double),
    (8, Double),
];

pub(super) const PAGE_HEADER: Fields = &[
    (1, Whole),
    (2, Whole),
    (3, Whole),
    (4, Whole),
    (5, Structure(&[(1, Whole), (2, Whole), (3, Whole), (4, Whole), (5, Structure(STATISTICS))])),
    (6, Structure(&[])),
    (7, Structure(&[(1, Whole), (2, Whole), (3, Truth)])),
    (8, Structure(DATA_PAGE_2)),
];
const DATA_PAGE_2: Fields = &[
    (1, Whole),
    (2, Whole),
    (3, Whole),
    (4, Whole),
    (5, Whole),
    (6, Whole),
    (7, Truth),
    (8, Structure(STATISTICS)),
];

impl Type {
    /// Whether a value of this kind, as its protocol counts kinds, is one.
    fn is(self, kind: u8) -> bool {
        match self {
            Truth => matches!(kind, 1 | 2),
            Byte => kind == 3,
            Whole => (4..=6).contains(&kind),
            Double => kind == 7,
            Text => kind == 8,
            List(_) => kind == 9,
            Structure(_) | Union(_) => kind == 12,
        }
    }
}

/// A walk through values of Thrift's compact protocol.
pub(super) struct Walk<'a> {
    pub(super) rest: &'a [u8],
    /// Whether there was a list of more members than there are bytes.
    pub(super) too_long: bool,
    /// The outermost field that is being read.
    field: i64,
    /// Whole numbers of the outermost structure and of those in it: outer field, own field, value.
    numbers: Vec<(i64, i64, i64)>,
}

impl<'a> Walk<'a> {
    pub(super) fn of(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, too_long: false, field: 0, numbers: Vec::new() }
    }

    /// A whole number of the outermost structure, whose two fields are then the same, or of one in it.
    pub(super) fn found(&self, outer: i64, own: i64) -> Option<i64> {
        let found = self.numbers.iter().rfind(|number| (number.0, number.1) == (outer, own));
        found.map(|number| number.2)
    }

    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.rest.split_first()?;
        self.rest = rest;
        Some(*first)
    }

    fn skip(&mut self, count: usize) -> Option<()> {
        self.rest = self.rest.get(count..)?;
        Some(())
    }

    /// A number, seven bits a byte.
    fn number(&mut self) -> Option<u64> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7F) << shift;
            if byte < 0x80 {
                return Some(number);
            }
        }
        None
    }

    /// So many members, each of at least a byte.
    fn members(&mut self, count: u64) -> Option<u64> {
        self.too_long |= count > self.rest.len() as u64;
        (!self.too_long).then_some(count)
    }

    /// A structure; of a union all fields are structures.
    pub(super) fn structure(
        &mut self,
        (fields, is_union): (Option<Fields>, bool),
        depth: usize,
    ) -> Option<()> {
        let mut number: i64 = 0;
        loop {
            let head = self.byte()?;
            if head == 0 {
                return Some(());
            }
            // Fields stand in order; a number of its own is written for what no format of a footer has.
            number += i64::from(head >> 4);
            if head >> 4 == 0 {
                return None;
            }
            let kind = head & 0x0F;
            let known = fields.and_then(|all| all.iter().find(|field| field.0 == number));
            let wanted = known.map(|field| field.1).or(is_union.then_some(Structure(&[])));
            // The field's kind says what a truth value is.
            wanted.is_none_or(|wanted| wanted.is(kind)).then_some(())?;
            let outer = if depth == 0 { number } else { self.field };
            if depth == 0 {
                self.field = number;
            }
            match kind {
                1 | 2 => {}
                4..=6 => {
                    let zigzag = self.number()?;
                    if depth < 2 {
                        let value = i64::try_from(zigzag >> 1).ok()? ^ -i64::from(zigzag & 1 == 1);
                        self.numbers.push((outer, number, value));
                    }
                }
                _ => self.value((kind, wanted), depth + 1)?,
            }
        }
    }

    fn value(&mut self, (kind, wanted): (u8, Option<Type>), depth: usize) -> Option<()> {
        wanted.is_none_or(|wanted| wanted.is(kind)).then_some(())?;
        match kind {
            1..=3 => self.skip(1),
            4..=6 => self.number().map(drop),
            7 => self.skip(8),
            8 => {
                let length = self.number()?;
                self.skip(usize::try_from(length).ok()?)
            }
            9 | 10 if depth < DEEPEST => {
                let head = self.byte()?;
                let count = if head >> 4 == 15 { self.number()? } else { u64::from(head >> 4) };
                let member = match wanted {
                    Some(List(member)) => Some(*member),
                    _ => None,
                };
                // Truth values stand in no list of the format; the reader takes no bytes for them.
                if count > 0 && matches!(head & 0x0F, 1 | 2) {
                    return None;
                }
                let mut members = 0..self.members(count)?;
                members.try_for_each(|_| self.value((head & 0x0F, member), depth + 1))
            }
            12 if depth < DEEPEST => {
                let fields = match wanted {
                    Some(Structure(fields)) => (Some(fields), false),
                    Some(Union(fields)) => (Some(fields), true),
                    _ => (None, false),
                };
                self.structure(fields, depth)
            }
            // Maps are in no footer.
            _ => None,
        }
    }
}
