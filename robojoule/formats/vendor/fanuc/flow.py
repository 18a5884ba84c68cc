"""How a teach pendant program goes from instruction to instruction: labels, jumps, branches, loops."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence

from lark import Token, Tree

from robojoule.formats.vendor.cycles import keep_cycle
from robojoule.formats.vendor.fanuc.changes import action_of, assigns, is_payload
from robojoule.formats.vendor.fanuc.labels import endless_labels, label_of, labels_in, plain_label, repeated_labels
from robojoule.formats.vendor.fanuc.registers import Registers, index_of
from robojoule.formats.vendor.fanuc.syntax import Block, Instruction, Node, is_remark, within
from robojoule.formats.vendor.lines import flaw_of, short
from robojoule.formats.vendor.running import Leave, Running
from robojoule.formats.vendor.trace import CycleStart, Kind, Wait

ADDED = "!Wait added by robojoule"  # the remark before waits that plans add
KINDS: dict[str, Kind] = {"J": "joint", "L": "linear", "S": "linear", "C": "circular", "A": "circular"}
# First words of instructions that move nothing; every other one may be a macro.
_HARMLESS = {"ARC", "COL", "COLLISION", "ELSE", "ENDIF", "ENDFOR", "FORCE", "LOCK", "MESSAGE", "OFFSET", "PAYLOAD"}
_HARMLESS |= {"PULSE", "RSR", "SKIP", "SPOT", "TC_ONLINE", "TOOL_OFFSET", "TRACK", "UALM", "UNLOCK", "VOFFSET", "WEAVE"}
_HARMLESS |= {"WELD", "TIME", "DISTANCE", "STOP", "RESUME", "SYNC", "LBL", "MONITOR", "DEPARTURE", "FLG", "VISION"}


class Flow(Running, ABC):
    """Runs instructions and blocks; what an instruction does is for a rule of its kind to say."""

    def __init__(self) -> None:
        super().__init__()
        self.registers = Registers()
        self.added: Instruction | None = None  # the remark that announces the wait of a plan
        self.labels: dict[str, int] = {}  # labels that were passed: number of motions before
        self.jumps: dict[str, list[int]] = {}  # conditional jumps that were met, by label: number of motions before
        self.starts: dict[int, int] = {}  # labels to which the program always comes back: number of events before
        self.motions = 0

    @abstractmethod
    def state(self) -> object:
        """What is known of registers and frames, to compare passes of a loop."""

    @abstractmethod
    def wait(self, one: Instruction, tree: Node, announced: Instruction | None) -> None:
        """A WAIT, and the remark before it if that says that a plan has added it."""

    @abstractmethod
    def forget_all(self, one: Instruction, body: Sequence[Instruction | Block]) -> None:
        """What instructions set that run or not, nobody knows; `one` decides."""

    def run(self, body: Sequence[Instruction | Block]) -> None:
        """Run a program from its beginning."""
        try:
            target = self._walk(body, 0)
            if target is None:
                return

            def next_pass() -> bool:
                self.jumps.clear()
                return self._walk(body, target + 1) == target

            label = body[target]
            assert isinstance(label, Instruction)
            keep_cycle(self, self.starts[target], label.line.number, next_pass, self.state)
        except Leave:
            pass

    def _walk(self, body: Sequence[Instruction | Block], at: int) -> int | None:
        """Run instructions from one of them on, up to a jump back; gives the label to which it leads."""
        labels = {
            label_of(one): i for i, one in enumerate(body) if isinstance(one, Instruction) and one.kind == "label"
        }
        endless, repeated = endless_labels(body, labels), repeated_labels(body, labels)
        while at < len(body):
            one = body[at]
            if isinstance(one, Instruction) and one.kind == "jump":
                target = labels.get(label_of(one))
                if target is None:
                    self.unknown(one.line.number, f"{short(one.code)} leads nowhere")
                    return None
                if target <= at and target not in self.starts:
                    self.unknown(one.line.number, f"{short(one.code)} leads to lines that were jumped over")
                    return None
                if target <= at:
                    return target
                at = target
                continue
            if isinstance(one, Instruction) and one.kind == "label":
                self._label(one, endless=at in endless, repeated=at in repeated)
                self.starts |= {at: len(self.events)} if at in endless else {}
            else:
                self._one(one)
            at += 1
        return None

    def _one(self, one: Instruction | Block) -> None:
        self.count((one.head if isinstance(one, Block) else one).line.number)
        if isinstance(one, Block):
            if one.head.kind == "for_":
                self._for(one)
            else:
                self._skip(one)
            return
        announced, self.added = self.added, None
        if one.tree is None:
            self._plain(one)
        elif one.kind == "wait":
            self.wait(one, one.tree, announced)
        elif one.kind == "end":
            raise Leave("program")
        else:
            rule = getattr(self, f"_{one.kind}", None)
            if rule is not None:
                rule(one, one.tree)

    def _plain(self, one: Instruction) -> None:
        """An instruction without a tree: empty, a remark, or not understood."""
        if one.code == ADDED:
            self.added = one
        elif one.code and not is_remark(one.code) and not one.code.startswith("-"):
            if one.code[:1].upper() in KINDS and one.code[1:2].isspace() and one.code[2:].lstrip()[:1] == "P":
                self.unknown(one.line.number, f"the motion is not understood{flaw_of(one.code)}: {short(one.code)}")
            else:
                self.unknown(
                    one.line.number,
                    f"not understood{flaw_of(one.code)}, it may move the robot: {short(one.code)}",
                    may_stand=True,
                )

    def _label(self, one: Instruction, *, endless: bool, repeated: bool) -> None:
        name = label_of(one)
        self.labels[name] = self.motions
        if endless:
            self.events.append(CycleStart(one.line.number))
        elif repeated or any(before < self.motions for before in self.jumps.get(name, [])):
            self.unknown(
                one.line.number, f"{name} is reached from several places: the robot's position is not known behind it"
            )

    def _branch(self, one: Instruction, tree: Node) -> None:
        action, code, line = action_of(one), short(one.code), one.line.number
        self.forget_all(one, [one])
        label = next((plain_label(str(token)) for token in action if token.type == "LABEL"), None)
        if label is not None:
            if self.labels.get(label) == self.motions:  # goes round until it need not
                self.events.append(Wait(one.code_start, line, None, code))
            self.may_jump([label])
            self.note(line, f"whether it jumps is not known, it is taken not to: {code}")
        elif action and action[0].upper() in ("END", "ABORT"):
            self.note(line, f"whether the program ends here is not known, it is taken not to: {code}")
        elif action and action[0].upper() == "PAUSE":
            self.events.append(Wait(one.code_start, line, None, code))
        elif assigns(action) or is_payload(action) or (action and is_harmless(action[0])):
            self.note(line, f"whether it runs is not known, it is kept: {code}")
        else:
            self.unknown(line, f"whether it runs is not known, it may move the robot: {code}", may_stand=True)

    def _for(self, block: Block) -> None:
        tree = block.head.tree
        assert tree is not None
        register, *rest = tree.children
        split = next(at for at, one in enumerate(rest) if isinstance(one, Token))
        first, last = (
            self.registers.total(
                [one.children[0] for one in part if isinstance(one, Tree) and isinstance(one.children[0], Token)]
            )
            for part in (rest[:split], rest[split + 1 :])
        )
        number = index_of(str(register))
        jumps = any(one.kind in ("label", "jump") for one in within(block.body))
        if first is None or last is None or number is None or jumps:
            self._skip(block)
            return
        step = -1.0 if "DOWN" in str(rest[split]).upper() else 1.0
        values = self.registers.values
        values[number] = first
        while (values[number] <= last) if step > 0.0 else (values[number] >= last):
            self.count(block.head.line.number)
            for one in block.body:
                self._one(one)
            if number not in values:  # set to what nobody knows
                self._skip(block)
                return
            if values[number] == last:
                return
            values[number] += step

    def may_jump(self, labels: Iterable[str]) -> None:
        """The program may go on from here at labels, nobody knows whether."""
        for label in labels:
            self.jumps.setdefault(label, []).append(self.motions)

    def _skip(self, block: Block) -> None:
        """Instructions that run or not, nobody knows: where the robot is behind them is not known, if they move it."""
        moves = waits = False
        for one in within([block]):
            waits |= one.kind in ("wait", "pause")
            moves |= one.kind in ("motion", "call", "jump", "branch", "label") or may_be_macro(one)
            self.may_jump(labels_in(one) if one.kind != "label" else ())
            if one.kind == "end":
                text = f"whether the program ends here is not known, it is taken not to: {short(one.code)}"
                self.note(one.line.number, text)
        self.forget_all(block.head, [block])
        head = block.head
        self.skipped(head.line.number, head.code_start, head.code, moves=moves, waits=waits)


def _places_of_labels(body: Sequence[Instruction | Block]) -> dict[str, int]:
    """Places in a program by the labels there."""
    return {label_of(one): at for at, one in enumerate(body) if isinstance(one, Instruction) and one.kind == "label"}


def may_be_macro(one: Instruction) -> bool:
    """Whether an instruction is none that is known to move nothing."""
    if one.tree is None:
        return bool(one.code) and not is_remark(one.code)
    return one.kind == "statement" and not is_harmless(str(one.tree.children[0]))


def is_harmless(first: str) -> bool:
    """Whether an instruction that begins with a word is one that is known to move nothing."""
    word = first.split("[")[0].upper()
    return word in _HARMLESS or word.startswith("$")
