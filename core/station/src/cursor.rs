//! Cursors over octets: a reader that cannot run past the end, a writer that cannot overflow.
//!
//! DeviceNet is little endian, PROFIBUS big endian; both orders are here by name.

use core::fmt;

/// The octets ended before the value did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Short;

/// The buffer cannot take the octets; nothing of them was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Full;

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the octets end before the value does")
    }
}

impl fmt::Display for Full {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the buffer is too small for the octets")
    }
}

impl core::error::Error for Short {}
impl core::error::Error for Full {}

/// Reads values from the front of a slice. A read that does not fit takes nothing.
#[derive(Clone, Debug)]
pub struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    /// A reader at the first octet of `octets`.
    #[inline]
    #[must_use]
    pub const fn new(octets: &'a [u8]) -> Self {
        Self { rest: octets }
    }

    /// The octets not yet read.
    #[inline]
    #[must_use]
    pub const fn rest(&self) -> &'a [u8] {
        self.rest
    }

    /// Whether all octets have been read.
    #[inline]
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    /// The next `N` octets.
    ///
    /// # Errors
    /// [`Short`] where fewer are left.
    #[inline]
    pub fn array<const N: usize>(&mut self) -> Result<[u8; N], Short> {
        let (head, rest) = self.rest.split_first_chunk::<N>().ok_or(Short)?;
        self.rest = rest;
        Ok(*head)
    }

    /// The next `count` octets.
    ///
    /// # Errors
    /// [`Short`] where fewer are left.
    #[inline]
    pub fn octets(&mut self, count: usize) -> Result<&'a [u8], Short> {
        let (head, rest) = self.rest.split_at_checked(count).ok_or(Short)?;
        self.rest = rest;
        Ok(head)
    }

    /// One octet.
    ///
    /// # Errors
    /// [`Short`] where none is left.
    #[inline]
    pub fn u8(&mut self) -> Result<u8, Short> {
        self.array::<1>().map(u8::from_le_bytes)
    }

    /// Two octets, low octet first.
    ///
    /// # Errors
    /// [`Short`] where fewer are left.
    #[inline]
    pub fn u16_le(&mut self) -> Result<u16, Short> {
        self.array().map(u16::from_le_bytes)
    }

    /// Four octets, low octet first.
    ///
    /// # Errors
    /// [`Short`] where fewer are left.
    #[inline]
    pub fn u32_le(&mut self) -> Result<u32, Short> {
        self.array().map(u32::from_le_bytes)
    }

    /// Eight octets, low octet first.
    ///
    /// # Errors
    /// [`Short`] where fewer are left.
    #[inline]
    pub fn u64_le(&mut self) -> Result<u64, Short> {
        self.array().map(u64::from_le_bytes)
    }

    /// Two octets, high octet first.
    ///
    /// # Errors
    /// [`Short`] where fewer are left.
    #[inline]
    pub fn u16_be(&mut self) -> Result<u16, Short> {
        self.array().map(u16::from_be_bytes)
    }

    /// Four octets, high octet first.
    ///
    /// # Errors
    /// [`Short`] where fewer are left.
    #[inline]
    pub fn u32_be(&mut self) -> Result<u32, Short> {
        self.array().map(u32::from_be_bytes)
    }
}

/// Appends values to a slice. A write that does not fit writes nothing of itself.
#[derive(Debug)]
pub struct Writer<'a> {
    buffer: &'a mut [u8],
    length: usize,
}

impl<'a> Writer<'a> {
    /// A writer at the first octet of `buffer`.
    #[inline]
    #[must_use]
    pub const fn new(buffer: &'a mut [u8]) -> Self {
        Self { buffer, length: 0 }
    }

    /// How many octets have been written.
    #[inline]
    #[must_use]
    pub const fn len(&self) -> usize {
        self.length
    }

    /// Whether nothing has been written yet.
    #[inline]
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// What has been written so far.
    #[inline]
    #[must_use]
    pub fn written(&self) -> &[u8] {
        self.buffer.get(..self.length).unwrap_or_default()
    }

    /// Forgets everything written after the first `length` octets.
    #[inline]
    pub const fn truncate(&mut self, length: usize) {
        if length < self.length {
            self.length = length;
        }
    }

    /// Appends `octets`.
    ///
    /// # Errors
    /// [`Full`] where they do not fit.
    #[inline]
    pub fn octets(&mut self, octets: &[u8]) -> Result<(), Full> {
        let end = self.length.checked_add(octets.len()).ok_or(Full)?;
        self.buffer.get_mut(self.length..end).ok_or(Full)?.copy_from_slice(octets);
        self.length = end;
        Ok(())
    }

    /// Appends one octet.
    ///
    /// # Errors
    /// [`Full`] where it does not fit.
    #[inline]
    pub fn u8(&mut self, value: u8) -> Result<(), Full> {
        self.octets(&[value])
    }

    /// Appends two octets, low octet first.
    ///
    /// # Errors
    /// [`Full`] where they do not fit.
    #[inline]
    pub fn u16_le(&mut self, value: u16) -> Result<(), Full> {
        self.octets(&value.to_le_bytes())
    }

    /// Appends four octets, low octet first.
    ///
    /// # Errors
    /// [`Full`] where they do not fit.
    #[inline]
    pub fn u32_le(&mut self, value: u32) -> Result<(), Full> {
        self.octets(&value.to_le_bytes())
    }

    /// Appends eight octets, low octet first.
    ///
    /// # Errors
    /// [`Full`] where they do not fit.
    #[inline]
    pub fn u64_le(&mut self, value: u64) -> Result<(), Full> {
        self.octets(&value.to_le_bytes())
    }

    /// Appends two octets, high octet first.
    ///
    /// # Errors
    /// [`Full`] where they do not fit.
    #[inline]
    pub fn u16_be(&mut self, value: u16) -> Result<(), Full> {
        self.octets(&value.to_be_bytes())
    }

    /// Appends four octets, high octet first.
    ///
    /// # Errors
    /// [`Full`] where they do not fit.
    #[inline]
    pub fn u32_be(&mut self, value: u32) -> Result<(), Full> {
        self.octets(&value.to_be_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_read_that_does_not_fit_takes_nothing() {
        let mut reader = Reader::new(&[1, 2, 3]);
        assert_eq!(reader.u32_le(), Err(Short));
        assert_eq!(reader.u16_le(), Ok(0x0201));
        assert_eq!(reader.u16_be(), Err(Short));
        assert_eq!(reader.u8(), Ok(3));
        assert!(reader.is_empty());
    }

    #[test]
    fn a_write_that_does_not_fit_writes_nothing() {
        let mut buffer = [0xEE; 3];
        let mut writer = Writer::new(&mut buffer);
        writer.u16_be(0x0102).unwrap();
        assert_eq!(writer.u16_le(0x0304), Err(Full));
        assert_eq!(writer.written(), [1, 2]);
        writer.truncate(1);
        assert_eq!(writer.len(), 1);
        assert_eq!(buffer, [1, 2, 0xEE]);
    }

    #[test]
    fn both_octet_orders_read_back_what_they_wrote() {
        let mut buffer = [0; 18];
        let mut writer = Writer::new(&mut buffer);
        writer.u32_le(0x0A0B_0C0D).unwrap();
        writer.u32_be(0x0A0B_0C0D).unwrap();
        writer.u64_le(1 << 40).unwrap();
        writer.u16_le(7).unwrap();
        let mut reader = Reader::new(&buffer);
        assert_eq!(reader.array(), Ok([0x0D, 0x0C, 0x0B, 0x0A]));
        assert_eq!(reader.u32_be(), Ok(0x0A0B_0C0D));
        assert_eq!(reader.u64_le(), Ok(1 << 40));
        assert_eq!(reader.octets(2), Ok(&[7, 0][..]));
    }
}
