"""Compiled loops over the bytes of CSV text: cells of each row, and the numbers of plain cells.

Other cells are left to the caller. The loops run without the interpreter's lock, so that several
threads can share a text. Importing numba takes most of a second: only readers of large files import
this module.
"""

from __future__ import annotations

import numba
import numpy as np

from workbench.tracking.source import LARGEST

__all__ = ["SKIPPED", "WORDS", "count_cells", "number_words", "read_cells"]

SKIPPED, WORDS = -1, -2
"""Columns of `read_cells` without numbers: `WORDS - k` is the k-th column of text."""
_COMMA, _RETURN, _QUOTE, _MINUS, _POINT, _ZERO, _HASH = b',\r"-.0#'
_NAN, _LOWER = tuple(b"nan"), 0x20
# whole numbers up to 2^53 and powers of ten up to 22 are exact: their quotient is rounded correctly
_EXACT, _DIGITS, _POWERS = 1 << 53, 18, 10.0 ** np.arange(23)
_HASH_START, _HASH_FACTOR, _HASH_MASK = 5381, 33, 0x7FFFFFFF  # Bernstein's

# Indices in inner loops are cast to unsigned ones: signed ones are checked for being negative.


@numba.njit(cache=True, nogil=True)
def count_cells(text, begins, ends, widths, edges):
    """Look over the rows from `begins` to `ends`.

    Fill `widths` (n,) with their cells and `edges` (2, n) with their first and last bytes; all are
    0 where a row is blank.
    """
    for row in range(len(begins)):
        commas = 0
        for i in range(begins[row], ends[row]):
            commas += text[np.uint64(i)] == _COMMA
        given = ends[row] > begins[row]
        widths[row] = commas + 1 if given else 0
        edges[0, row] = text[begins[row]] if given else 0
        edges[1, row] = text[ends[row] - 1] if given else 0


@numba.njit(cache=True, nogil=True)
def read_cells(text, begins, ends, columns, numbers, places, words, odd):
    """Read the cells of n rows.

    Args:
        text: bytes of the file.
        begins: (n,) where each row begins.
        ends: (n,) one past its content, the line end not included.
        columns: for each cell of a row an index into `numbers`, `SKIPPED`, or `WORDS` - k.
        numbers: (k, N) filled, NaN where blank.
        places: (n,) of the rows among the N.
        words: (w, n, 2) filled with begin and end of each.
        odd: (s, 4) filled with column, row, begin and end of cells without a plain number.

    Returns:
        How many cells are odd, even if more than `odd` holds; -1 where a row has another number of
        cells, a carriage return, quotes that are not around a word, or an absurd number.
    """
    found, plain = 0, True
    for row in range(len(begins)):
        i, stop, place = begins[row], ends[row], np.uint64(places[row])
        for column in columns:
            begin = i
            if column >= 0:
                minus = i < stop and text[np.uint64(i)] == _MINUS
                i += minus
                start, decimals = i, 0
                whole, i = _digits(text, i, stop, 0)
                digits = i - start
                if i < stop and text[np.uint64(i)] == _POINT:
                    i += 1
                    start = i
                    whole, i = _digits(text, i, stop, whole)
                    decimals = i - start
                    digits += decimals
                if (
                    0 < digits <= _DIGITS
                    and whole <= _EXACT
                    and (i >= stop or text[np.uint64(i)] == _COMMA)
                ):
                    value = whole / _POWERS[np.uint64(decimals)]
                    if minus:
                        value = -value
                    if value > LARGEST or value < -LARGEST:
                        plain = False
                else:
                    value = np.nan
                    while i < stop and text[np.uint64(i)] != _COMMA:
                        i += 1
                    if not _is_blank(text, begin, i):
                        if found < len(odd):
                            odd[found, 0], odd[found, 1] = column, places[row]
                            odd[found, 2], odd[found, 3] = begin, i
                        found += 1
                numbers[np.uint64(column), place] = value
            else:
                quotes, returns = 0, 0
                while i < stop and text[np.uint64(i)] != _COMMA:
                    quotes += text[np.uint64(i)] == _QUOTE
                    returns += text[np.uint64(i)] == _RETURN
                    i += 1
                if returns:
                    plain = False
                if quotes:
                    around = quotes == 2 and text[begin] == _QUOTE and text[i - 1] == _QUOTE
                    if column == SKIPPED or not around:
                        plain = False
                if column <= WORDS:
                    words[WORDS - column, row, 0], words[WORDS - column, row, 1] = begin, i
            i += 1
        if i != stop + 1:
            plain = False
    return found if plain else -1


@numba.njit(cache=True, nogil=True)
def number_words(text, words, codes):
    """Number the different words.

    Args:
        text: bytes of the file.
        words: (w, n, 2) begin and end of each.
        codes: (w, n) filled with indices into the different ones.

    Returns:
        (v, 2) begin and end of the first of each.
    """
    different, known = np.empty((64, 2), np.int64), 0
    table = np.full(2 * len(different), -1, np.int64)
    for column in range(words.shape[0]):
        for row in range(words.shape[1]):
            begin, end = words[column, row]
            if row > 0:  # words repeat
                code = codes[column, row - 1]
                if _alike(text, different[code, 0], different[code, 1], begin, end):
                    codes[column, row] = code
                    continue
            at = _place(table, different, text, begin, end)
            if table[at] < 0:
                if known == len(different):
                    more = np.empty((2 * known, 2), np.int64)
                    more[:known] = different
                    different, table = more, np.full(4 * known, -1, np.int64)
                    for k in range(known):
                        table[_place(table, different, text, different[k, 0], different[k, 1])] = k
                    at = _place(table, different, text, begin, end)
                different[known], table[at] = words[column, row], known
                known += 1
            codes[column, row] = table[at]
    return different[:known]


@numba.njit(cache=True, nogil=True, inline="always")
def _digits(text, i, stop, whole):
    """Append the digits from byte `i` on to a whole number; return it and their end."""
    while i + 4 <= stop:  # four at a time: one by one each would wait for the last
        a, b = _digit(text, i), _digit(text, i + 1)
        c, d = _digit(text, i + 2), _digit(text, i + 3)
        if (a > 9) | (b > 9) | (c > 9) | (d > 9):
            break
        whole = 10_000 * whole + (1000 * a + 100 * b + 10 * c + d)
        i += 4
    while i < stop and _digit(text, i) <= 9:
        whole = 10 * whole + _digit(text, i)
        i += 1
    return whole, i


@numba.njit(cache=True, nogil=True, inline="always")
def _digit(text, i):
    """Return the digit that a byte is, or a number above 9."""
    return np.int64(text[np.uint64(i)]) ^ _ZERO


@numba.njit(cache=True, nogil=True)
def _is_blank(text, begin, end):
    """Return whether a cell has no number: empty, NaN, or with the sign of the old C runtime."""
    hashes = 0
    for i in range(begin, end):
        if text[i] == _RETURN:
            return False
        hashes += text[i] == _HASH
    if hashes:
        return True
    if end - begin != len(_NAN):
        return begin == end
    return (text[begin] | _LOWER, text[begin + 1] | _LOWER, text[begin + 2] | _LOWER) == _NAN


@numba.njit(cache=True, nogil=True)
def _alike(text, begin, end, other, stop):
    if end - begin != stop - other:
        return False
    alike = True
    for k in range(end - begin):
        alike &= text[np.uint64(begin + k)] == text[np.uint64(other + k)]
    return alike


@numba.njit(cache=True, nogil=True)
def _place(table, words, text, begin, end):
    """Return the index of a word in a table of hashes, or of its free entry; never full."""
    key = _HASH_START
    for i in range(begin, end):
        key = (_HASH_FACTOR * key + text[i]) & _HASH_MASK
    at = key & (len(table) - 1)
    while table[at] >= 0:
        if _alike(text, words[table[at], 0], words[table[at], 1], begin, end):
            return at
        at = (at + 1) & (len(table) - 1)
    return at
