"""The client's rules of docs/wire.md, section 7, in virtual time."""
from __future__ import annotations

import concurrent.futures
import unittest

import client_support  # noqa: F401  it finds the package

import slabstream as ss  # noqa: E402
from slabstream import schema  # noqa: E402
from slabstream.requests import MOST_OPEN, PING_SECONDS, SILENCE_SECONDS, Requests  # noqa: E402


class Watcher:
    def __init__(self) -> None:
        self.told: list = []

    def progressed(self, progress) -> None:
        self.told.append(progress.phase)

    def replied(self, reply, payload) -> None:
        self.told.append((reply.groups_done, bytes(payload)))

    def failed(self, error) -> None:
        self.told.append(error)


class RequestsTest(unittest.TestCase):
    def setUp(self) -> None:
        self.sent: list = []
        self.requests = Requests("ipc:///s", self.sent.append)
        self.now = 100.0
        self.watcher = Watcher()

    def submit(self, deadline: float = 60) -> int:
        request = next(self.requests.numbers)
        self.requests.submit(request, schema.FrameRequest(dataset="ball"), deadline, self.watcher, self.now)
        return request

    def receive(self, payload: bytes | None = None, version: int = schema.WIRE_VERSION, **message) -> None:
        parts = [schema.Envelope(version=version, **message).SerializeToString()]
        self.requests.receive(parts if payload is None else [*parts, payload], self.now)

    def taken(self) -> list[str]:
        kinds = [envelope.WhichOneof("message") for envelope in self.sent]
        self.sent.clear()
        return kinds

    def pings(self) -> list:
        found = [envelope.client_ping for envelope in self.sent if envelope.HasField("client_ping")]
        self.sent.clear()
        return found

    def test_a_request_is_told_of_until_its_picture(self) -> None:
        request = self.submit()
        self.receive(frame_progress=schema.FrameProgress(request=request, phase=schema.FRAME_PHASE_RUNNING))
        shares = [schema.PictureShare(runs=schema.EncodedRuns(encoded_bytes=3))]
        self.receive(b"abc", frame_reply=schema.FrameReply(request=request, groups_done=1, group_count=2, shares=shares))
        self.receive(b"abc", frame_reply=schema.FrameReply(request=request, groups_done=2, group_count=2, shares=shares))
        self.receive(frame_failed=schema.FrameFailed(request=request))  # too late
        self.assertEqual(self.watcher.told, [schema.FRAME_PHASE_RUNNING, (1, b"abc"), (2, b"abc")])

    def test_a_status_becomes_the_exception_of_its_code(self) -> None:
        for code, kind in ((1, ss.InvalidArgument), (2, ss.NotFound), (4, ss.ResourceExhausted), (7, ss.DeadlineExceeded), (99, ss.Internal)):
            request = self.submit()
            status = schema.Status(message="why")
            status.code = code
            self.receive(frame_failed=schema.FrameFailed(request=request, status=status))
            self.assertIs(type(self.watcher.told[-1]), kind)
            self.assertEqual(str(self.watcher.told[-1]), "why")

    def test_pings_list_what_is_open_and_silence_fails_it(self) -> None:
        first, second = self.submit(), self.submit()
        self.taken()
        self.assertEqual(self.requests.tick(self.now), self.now + PING_SECONDS)
        self.assertEqual(self.pings(), [])
        self.now += PING_SECONDS
        self.requests.tick(self.now)
        self.assertEqual(list(self.pings()[0].open), [first, second])
        self.now += SILENCE_SECONDS
        self.requests.tick(self.now)
        self.assertEqual([type(told) for told in self.watcher.told], [ss.Unavailable] * 2)
        self.assertEqual(str(self.watcher.told[0]), "the service at ipc:///s has not answered for 5000 ms")

    def test_a_question_fails_if_the_service_is_silent(self) -> None:
        answer: concurrent.futures.Future[object] = concurrent.futures.Future()
        self.requests.ask(7, "status_query", schema.StatusQuery(), answer, self.now)
        self.now += PING_SECONDS
        self.requests.tick(self.now)
        self.assertEqual(len(self.pings()), 1)
        self.now += SILENCE_SECONDS
        self.requests.tick(self.now)
        self.assertIsInstance(answer.exception(0), ss.Unavailable)

    def answer_pings(self, known: list[int]) -> None:
        self.now += PING_SECONDS
        self.requests.tick(self.now)
        for ping in self.pings():
            self.receive(client_pong=schema.ClientPong(nonce=ping.nonce, known=known))

    def test_what_a_pong_does_not_know_is_submitted_again_with_what_is_left_of_its_time(self) -> None:
        request = self.submit(deadline=60)
        self.taken()
        self.answer_pings([request])
        self.assertEqual(self.taken(), [])
        self.answer_pings([])
        again = self.sent[0].submit_frame
        self.assertEqual((again.request, again.deadline_ms, again.frame.dataset), (request, 58000, "ball"))

    def test_pings_that_were_under_way_do_not_submit_it_once_more(self) -> None:
        self.submit()
        self.taken()
        for _ in range(3):
            self.now += PING_SECONDS
            self.requests.tick(self.now)
        pings = self.pings()
        for ping in pings:
            self.receive(client_pong=schema.ClientPong(nonce=ping.nonce))
        self.assertEqual((len(pings), self.taken()), (3, ["submit_frame"]))

    def test_a_request_is_lost_four_times_at_most(self) -> None:
        self.submit(deadline=600)
        for _ in range(4):
            self.answer_pings([])
        self.assertIsInstance(self.watcher.told[0], ss.Unavailable)
        self.assertIn("lost the request 4 times", str(self.watcher.told[0]))

    def test_what_was_cancelled_is_not_submitted_again(self) -> None:
        request = self.submit()
        self.requests.cancel(request)
        self.answer_pings([])
        self.assertEqual(self.taken(), [])
        self.assertIsInstance(self.watcher.told[0], ss.Cancelled)

    def test_a_lost_request_whose_time_is_over_fails(self) -> None:
        self.submit(deadline=1)
        self.answer_pings([])
        self.assertIsInstance(self.watcher.told[0], ss.DeadlineExceeded)

    def ask(self, kind: str, message) -> tuple[int, concurrent.futures.Future]:
        answer: concurrent.futures.Future = concurrent.futures.Future()
        nonce = next(self.requests.numbers)
        self.requests.ask(nonce, kind, message, answer, self.now)
        self.taken()
        return nonce, answer

    def lose(self, pongs: int) -> None:
        """The service has nothing of what it is asked about."""
        for _ in range(pongs):
            self.now += PING_SECONDS
            self.requests.tick(self.now)
            ping = self.pings()[-1]
            self.receive(client_pong=schema.ClientPong(nonce=ping.nonce, lost=ping.asked))

    def test_what_changes_nothing_and_is_lost_is_asked_again(self) -> None:
        for kind, message in (("summary_query", schema.SummaryQuery(dataset="ball")), ("status_query", schema.StatusQuery()),
                              ("data_order", schema.DataOrder(action=schema.DATA_ACTION_LIST)), ("steer_dataset", schema.SteerDataset(dataset="ball"))):
            with self.subTest(kind=kind):
                nonce, answer = self.ask(kind, message)
                self.answer_pings([])  # it is known: none of those asked about is lost
                self.assertEqual(self.taken(), [])
                self.lose(1)
                self.assertEqual([(each.WhichOneof("message"), getattr(each, kind).nonce) for each in self.sent], [(kind, nonce)])
                self.lose(3)
                self.assertRegex(str(answer.exception(0)), "ipc:///s lost the request 4 times")

    def test_an_order_that_is_lost_fails_and_is_not_sent_again(self) -> None:
        for kind, message in (("data_order", schema.DataOrder(action=schema.DATA_ACTION_ADD, items=[b"/ball.nrrd"])),
                              ("data_order", schema.DataOrder(action=schema.DATA_ACTION_REMOVE, items=[b"ball"])),
                              ("steer_dataset", schema.SteerDataset(dataset="ball", values=[schema.SteeredValue(name="feed", value=1)]))):
            with self.subTest(kind=kind):
                _, answer = self.ask(kind, message)
                self.lose(1)
                self.assertEqual(self.taken(), [])
                self.assertIsInstance(answer.exception(0), ss.Unavailable)
                self.assertIn("the order may have been carried out or not", str(answer.exception(0)))

    def test_a_question_that_nobody_waits_for_is_not_asked_again(self) -> None:
        nonce, _ = self.ask("summary_query", schema.SummaryQuery(dataset="ball"))
        request = self.submit()
        self.requests.forget(nonce)
        self.taken()
        self.answer_pings([request])
        self.assertEqual(self.taken(), [])

    def test_a_file_is_told_of_until_it_is_lost(self) -> None:
        nonce, answer = self.ask("add_volume", schema.AddVolume(name="mesh", file=schema.SentFile(name="mesh.vtk", bytes=3)))
        self.receive(data_reply=schema.DataReply(nonce=nonce))
        self.assertIsNone(answer.exception(0))
        self.answer_pings([])
        self.assertTrue(self.requests.has_file(nonce))
        self.lose(1)
        self.assertFalse(self.requests.has_file(nonce))
        self.requests.drop_file(nonce)
        self.assertEqual(self.taken(), [])

    def test_a_volume_that_is_lost_on_its_way_fails(self) -> None:
        answer: concurrent.futures.Future = concurrent.futures.Future()
        nonce = next(self.requests.numbers)
        self.requests.ask(nonce, "add_volume", schema.AddVolume(name="sent"), answer, self.now, lambda _: None)
        self.lose(1)
        self.assertIn("the part of the volume that was sent is lost", str(answer.exception(0)))

    def test_a_ping_tells_each_mebibyte_of_payload(self) -> None:
        request = self.submit()
        self.taken()
        shares = [schema.PictureShare(runs=schema.EncodedRuns(encoded_bytes=1 << 20))]
        self.receive(bytes(1 << 20), frame_reply=schema.FrameReply(request=request, groups_done=1, group_count=2, shares=shares))
        self.assertEqual([ping.received_bytes for ping in self.pings()], [1 << 20])

    def test_at_most_256_are_open(self) -> None:
        for _ in range(MOST_OPEN + 1):
            self.submit()
        self.assertEqual([str(told) for told in self.watcher.told], ["at most 256 requests may be open at once"])

    def test_messages_that_are_wrong_are_dropped(self) -> None:
        request = self.submit()
        status = schema.Status(code=1, message="no")
        with self.assertLogs("slabstream", "WARNING") as logs:
            self.receive(b"x", frame_failed=schema.FrameFailed(request=request, status=status))
            self.receive(welcome=schema.Welcome())
            self.receive()
            self.requests.receive([b"\xff\xff"], self.now)
            self.requests.receive([b"", b"", b""], self.now)
        self.assertEqual(len(logs.output), 5)
        self.assertEqual(self.watcher.told, [])

    def test_a_service_of_another_version_is_named(self) -> None:
        self.submit()
        self.receive(version=schema.WIRE_VERSION + 1)
        self.assertRegex(str(self.watcher.told), f"speaks version {schema.WIRE_VERSION + 1} .* this package version {schema.WIRE_VERSION}")

    def test_orders_are_answered_by_their_number(self) -> None:
        one: concurrent.futures.Future = concurrent.futures.Future()
        two: concurrent.futures.Future = concurrent.futures.Future()
        first, second = next(self.requests.numbers), next(self.requests.numbers)
        self.requests.ask(first, "status_query", schema.StatusQuery(), one, self.now)
        self.requests.ask(second, "data_order", schema.DataOrder(action=1), two, self.now)
        self.receive(order_refused=schema.OrderRefused(nonce=second, status=schema.Status(code=1, message="not an admin")))
        self.receive(status_reply=schema.StatusReply(nonce=first, pid=7))
        self.assertEqual(one.result(0).pid, 7)
        with self.assertRaisesRegex(ss.InvalidArgument, "not an admin"):
            two.result(0)

    def test_a_refused_key_ends_everything_for_good(self) -> None:
        answer: concurrent.futures.Future = concurrent.futures.Future()
        self.submit()
        self.requests.ask(1001, "status_query", schema.StatusQuery(), answer, self.now)
        self.requests.fail_all("refuses the key", for_good=True)
        self.submit()
        later: concurrent.futures.Future = concurrent.futures.Future()
        self.requests.ask(1002, "status_query", schema.StatusQuery(), later, self.now)
        for error in (*self.watcher.told, answer.exception(0), later.exception(0)):
            self.assertIsInstance(error, ss.Unavailable)


if __name__ == "__main__":
    unittest.main()
