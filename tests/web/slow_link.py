"""A relay on loopback that is as far away as a connection over the world: each direction takes half of the round trip and lets so many bits pass
a second. What is under way is never more than a network holds: the sender waits, as with TCP's window, here 4 MiB."""
import asyncio
import threading

WINDOW = 4 << 20


class SlowLink:
    def __init__(self, port, round_trip_ms, megabits):
        self.delay, self.rate = round_trip_ms / 2000, megabits * 1e6 / 8
        self.target = port
        self.ready = threading.Event()
        self.thread = threading.Thread(target=lambda: asyncio.run(self._run()), daemon=True)
        self.thread.start()
        self.ready.wait()

    def close(self):
        self.loop.call_soon_threadsafe(self.over.set)
        self.thread.join()

    async def _run(self):
        self.loop, self.over = asyncio.get_running_loop(), asyncio.Event()
        self.connections = set()
        self.free = {"up": 0.0, "down": 0.0}  # when the link of this direction is free again: all connections share it
        async with await asyncio.start_server(self._connected, "127.0.0.1", 0) as server:
            self.port = server.sockets[0].getsockname()[1]
            self.ready.set()
            await self.over.wait()
        for connection in self.connections:
            connection.cancel()
        await asyncio.gather(*self.connections, return_exceptions=True)

    async def _connected(self, reader, writer):
        self.connections.add(asyncio.current_task())
        down = None
        try:
            up, down = await asyncio.open_connection("127.0.0.1", self.target)
            await asyncio.gather(self._carry(reader, down, "up"), self._carry(up, writer, "down"))
        except OSError:
            pass
        finally:
            for end in filter(None, (writer, down)):
                end.close()
            self.connections.discard(asyncio.current_task())

    async def _carry(self, reader, writer, direction):
        under_way = asyncio.Queue()
        held, room = 0, asyncio.Event()

        async def deliver():
            nonlocal held
            while True:
                at, piece = await under_way.get()
                await asyncio.sleep(max(0.0, at - self.loop.time()))
                if not piece:
                    break
                held -= len(piece)
                room.set()
                try:
                    writer.write(piece)
                    await writer.drain()
                except OSError:
                    break
            writer.close()

        async def take():
            nonlocal held
            while True:
                try:
                    piece = await reader.read(1 << 14)
                except OSError:
                    piece = b""
                self.free[direction] = max(self.free[direction], self.loop.time()) + len(piece) / self.rate
                under_way.put_nowait((self.free[direction] + self.delay, piece))
                held += len(piece)
                if not piece:
                    break
                while held > WINDOW:
                    room.clear()
                    await room.wait()

        await asyncio.gather(take(), deliver())
