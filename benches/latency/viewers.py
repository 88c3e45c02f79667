"""Viewers of a running system: one that reads everything and one that stops reading, which blocks its connection."""

import base64
import contextlib
import json
import os
import select
import socket
import subprocess
import threading
import urllib.parse

TOPICS = ["/controller_state", "/joint_states", "/tf", "/cycle_timing", "/view"]
# A connection that is not read is full after this many descriptions of the arm (some 5 MB).
DESCRIPTIONS = 1000
TIMEOUT_S = 30
POLL_MS = 200
# A connection that takes nothing for this long is full.
STALLED_S = 2


def connect(url):
    """Opens a WebSocket; the returned file gives what the server sends."""
    address = urllib.parse.urlsplit(url)
    connection = socket.create_connection((address.hostname, address.port), TIMEOUT_S)
    key = base64.b64encode(os.urandom(16)).decode()
    request = [f"GET {address.path} HTTP/1.1"]
    request += [f"Host: {address.netloc}", "Upgrade: websocket", "Connection: Upgrade", f"Sec-WebSocket-Key: {key}"]
    request += ["Sec-WebSocket-Version: 13", "Sec-WebSocket-Protocol: foxglove.websocket.v1"]
    connection.sendall("".join(line + "\r\n" for line in [*request, ""]).encode())
    received = connection.makefile("rb")
    status = received.readline().decode()
    if " 101 " not in status:
        raise ConnectionError(f"{url}: {status.strip()}")
    while received.readline() not in (b"\r\n", b""):
        pass
    return connection, received


def read_message(received):
    """Kind (1: text) and content of the next message."""
    head = received.read(2)
    length = head[1] & 0x7F
    if length >= 126:
        length = int.from_bytes(received.read(2 if length == 126 else 8), "big")
    return head[0] & 0x0F, received.read(length)


def send(connection, message):
    """Sends a message as JSON. A client masks what it sends; a mask of zeros changes nothing."""
    content = json.dumps(message).encode()
    length = len(content)
    head = bytes([0x81, 0x80 | length]) if length < 126 else bytes([0x81, 0xFE]) + length.to_bytes(2, "big")
    connection.sendall(head + bytes(4) + content)


def channels(received):
    """The advertised channels, as {topic: id}."""
    while True:
        kind, content = read_message(received)
        message = json.loads(content) if kind == 1 else {}
        if message.get("op") == "advertise":
            return {channel["topic"]: channel["id"] for channel in message["channels"]}


def subscribe(connection, known, topics):
    wanted = [{"id": number, "channelId": known[topic]} for number, topic in enumerate(topics)]
    send(connection, {"op": "subscribe", "subscriptions": wanted})


def read_all(received, counts, problems, ended):
    """Reads until the benchmark closes the connection."""
    try:
        while True:
            read_message(received)
            counts["messages read"] += 1
    except (OSError, IndexError, ValueError) as error:
        if not ended.is_set():
            problems.append(f"the viewer that reads: {error!r}")


def read_nothing(url, counts, problems, ended):
    """Fills connections that are not read, one after the other, since the server drops each in the end."""
    try:
        while not ended.is_set():
            connection, received = connect(url)
            with connection:
                known = channels(received)
                connection.settimeout(STALLED_S)
                # The server reads on while the viewer does not: requests are refused or wait, or the server drops the viewer.
                with contextlib.suppress(TimeoutError, BrokenPipeError, ConnectionResetError):
                    subscribe(connection, known, TOPICS)
                    for _ in range(DESCRIPTIONS):
                        subscribe(connection, known, ["/robot_description"])
                counts["stalled connections"] += 1
                states = select.poll()
                states.register(connection, select.POLLRDHUP)
                while not ended.is_set() and not states.poll(POLL_MS):
                    pass
    except (OSError, IndexError, KeyError, ValueError) as error:
        if not ended.is_set():
            problems.append(f"the viewer that stalls: {error!r}")


@contextlib.contextmanager
def watching(programs, prefix, environment):
    """Runs `supple view` with both viewers; gives the counts of what they did and a list of problems, which a viewer has if
    the system ends before it."""
    command = [programs / "supple", "view", "--json", "--prefix", prefix]
    view = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    counts, problems = {"messages read": 0, "stalled connections": 0}, []
    ended = threading.Event()
    try:
        text = ""
        while not text.rstrip().endswith("}"):
            line = view.stdout.readline()
            if not line:
                raise ConnectionError("`supple view` has ended")
            text += line
        url = json.loads(text)["foxglove_url"]
        connection, received = connect(url)
        with connection:
            subscribe(connection, channels(received), TOPICS)
            connection.settimeout(None)
            reading = threading.Thread(target=read_all, args=(received, counts, problems, ended), daemon=True)
            stalling = threading.Thread(target=read_nothing, args=(url, counts, problems, ended), daemon=True)
            reading.start()
            stalling.start()
            yield counts, problems
            ended.set()
            stalling.join(TIMEOUT_S)
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
            reading.join(TIMEOUT_S)
    finally:
        ended.set()
        view.terminate()
        view.wait()
