"""OpenEXR files: the channels of a picture of Raywright, and pictures for it. Nothing here needs Blender."""

import struct
import zlib

import numpy as np

LINES_OF_BLOCK = {0: 1, 2: 1, 3: 16}
TYPES = {1: "<f2", 2: "<f4"}


class UnreadablePicture(Exception):
    pass


def _text(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def _inflated(packed, size):
    if len(packed) == size:
        return packed
    codes = np.frombuffer(zlib.decompress(packed), np.uint8).astype(np.uint8)
    codes[1:] -= 128
    codes = np.cumsum(codes, dtype=np.uint8)
    half = (len(codes) + 1) // 2
    whole = np.empty_like(codes)
    whole[0::2], whole[1::2] = codes[:half], codes[half:]
    return whole.tobytes()


def _header(data):
    if data[:4] != b"\x76\x2f\x31\x01":
        raise UnreadablePicture("not an OpenEXR file")
    at, header = 8, {}
    while data[at]:
        name, at = _text(data, at)
        _, at = _text(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        header[name] = data[at + 4 : at + 4 + size]
        at += 4 + size
    return header, at + 1


def read(path):
    """Name and float32 array, rows from the top, of each channel of a file of scan lines."""
    with open(path, "rb") as file:
        data = file.read()
    header, at = _header(data)
    kinds, place, listed = [], 0, header["channels"]
    while listed[place]:
        name, place = _text(listed, place)
        (kind,) = struct.unpack_from("<i", listed, place)
        kinds.append((name, np.dtype(TYPES[kind])))
        place += 16
    left, top, right, bottom = struct.unpack("<4i", header["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    lines = LINES_OF_BLOCK.get(header["compression"][0])
    if lines is None:
        raise UnreadablePicture("its compression is not one that Raywright writes")
    planes = {name: np.empty((height, width), np.float32) for name, _ in kinds}
    row_bytes = width * sum(kind.itemsize for _, kind in kinds)
    for offset in struct.unpack_from(f"<{-(-height // lines)}Q", data, at):
        y, size = struct.unpack_from("<ii", data, offset)
        y -= top
        rows = min(lines, height - y)
        raw = _inflated(data[offset + 8 : offset + 8 + size], rows * row_bytes)
        place = 0
        for row in range(y, y + rows):
            for name, kind in kinds:
                planes[name][row] = np.frombuffer(raw, kind, width, place)
                place += width * kind.itemsize
    return planes


def write(path, pixels):
    """Writes an array (rows from the top, columns, RGBA) as single precision without compression."""
    height, width, _ = pixels.shape
    channels = b"".join(name + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for name in (b"A", b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    attributes = [
        (b"channels", b"chlist", channels),
        (b"compression", b"compression", b"\0"),
        (b"dataWindow", b"box2i", window),
        (b"displayWindow", b"box2i", window),
        (b"lineOrder", b"lineOrder", b"\0"),
        (b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        (b"screenWindowCenter", b"v2f", struct.pack("<2f", 0, 0)),
        (b"screenWindowWidth", b"float", struct.pack("<f", 1)),
    ]
    head = b"\x76\x2f\x31\x01" + struct.pack("<I", 2)
    head += b"".join(n + b"\0" + t + b"\0" + struct.pack("<I", len(v)) + v for n, t, v in attributes) + b"\0"
    row_bytes = 16 * width
    start = len(head) + 8 * height
    with open(path, "wb") as file:
        file.write(head)
        file.write(struct.pack(f"<{height}Q", *(start + y * (8 + row_bytes) for y in range(height))))
        for y in range(height):
            file.write(struct.pack("<ii", y, row_bytes) + pixels[y, :, ::-1].T.astype("<f4").tobytes())


def write_png(path, pixels):
    """Writes codes (rows from the top, columns, RGBA) as a PNG."""
    height, width, _ = pixels.shape
    rows = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, 4 * width)], 1)

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)))
        file.write(chunk(b"IDAT", zlib.compress(rows.tobytes(), 1)) + chunk(b"IEND", b""))
