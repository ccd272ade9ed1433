"""A serial line that loses messages, between a program of a board and `wstac monitor`."""

import socket
import threading

# The numbers of the messages that it loses: an event, and the request that acknowledges one.
EVENT, ACKNOWLEDGE = 3, 5


class LossyLine:
    """A line between a board's program and `wstac monitor`, which loses each event and each acknowledgment once."""

    def __init__(self, board):
        self.board, self.sent, self.acknowledged = board, {}, {}
        self.server = socket.create_server(("127.0.0.1", 0))
        self.server.settimeout(60)

    @property
    def port(self):
        return f"tcp:127.0.0.1:{self.server.getsockname()[1]}"

    @staticmethod
    def frames(read):
        """Yields frames with their zeros and their content without COBS."""
        frame = b""
        while byte := read(1):
            if byte != b"\0":
                frame += byte
            elif frame:
                content, at = b"", 0
                while at < len(frame):
                    code = frame[at]
                    content += frame[at + 1 : at + code] + (b"\0" if code < 255 else b"")
                    at += code
                yield b"\0" + frame + b"\0", content[:-1]
                frame = b""

    @staticmethod
    def message(content):
        """Returns the message without version, sequence number and checksum."""
        at = 1
        while content[at] & 0x80:
            at += 1
        return content[at + 1 : -4]

    def pass_on(self, read, write, number, seen, key):
        """Passes frames on. The first frame of a message with this number and this key is lost."""
        for frame, content in self.frames(read):
            message = self.message(content)
            if message[0] == number:
                seen[message[key]] = seen.get(message[key], 0) + 1
                if seen[message[key]] == 1:
                    continue
            try:
                write(frame)
            except OSError:
                return

    def run(self):
        connection, _ = self.server.accept()
        requests, board = connection.makefile("rb", 0), self.board

        def to_board(frame):
            board.stdin.write(frame)
            board.stdin.flush()

        # An event begins with its frame's number, an acknowledgment with the event's.
        back = (requests.read, to_board, ACKNOWLEDGE, self.acknowledged, slice(1, 3))
        threading.Thread(target=self.pass_on, args=back, daemon=True).start()
        self.pass_on(board.stdout.read, connection.sendall, EVENT, self.sent, slice(1, 3))
        connection.shutdown(socket.SHUT_RDWR)
        connection.close()
        self.server.close()
