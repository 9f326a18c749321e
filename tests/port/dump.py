"""Reads the files of `build/ao --dump`: nothing but Python's own library. docs/porting.md tells what they hold."""
import json
import struct


def read_exr(path):
    """Width, height and a dictionary of channels, lists of floats from the top row down."""
    with open(path, "rb") as file:
        data = file.read()
    at, channels = 8, []  # after the magic number and the version

    def text():
        nonlocal at
        end = data.index(0, at)
        word, at = data[at:end].decode(), end + 1
        return word

    while name := text():
        text()  # the attribute's type
        (size,) = struct.unpack_from("<i", data, at)
        at += 4
        end = at + size
        if name == "channels":
            while data[at]:
                channels.append(text())
                at += 16
        elif name == "dataWindow":
            x0, y0, x1, y1 = struct.unpack_from("<4i", data, at)
        elif name == "compression":
            assert data[at] == 0, path + ": compressed"
        at = end
    width, height = x1 - x0 + 1, y1 - y0 + 1
    planes = {name: [0.0] * (width * height) for name in channels}
    for row in struct.unpack_from("<%dQ" % height, data, at):
        (y,) = struct.unpack_from("<i", data, row)
        for i, name in enumerate(channels):
            values = struct.unpack_from("<%df" % width, data, row + 8 + 4 * width * i)
            planes[name][(y - y0) * width : (y - y0 + 1) * width] = values
    return width, height, planes


def read_settings(directory):
    with open(directory + "/settings.json") as file:
        return json.load(file)
