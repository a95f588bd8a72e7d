"""What the judges say: each remark is one text of a table, with slots for what a run showed.

A remark is about what the student's function did: what came, what is right, what to write instead.
"""

from __future__ import annotations

from enum import StrEnum


class Remark(StrEnum):
    """Text of a remark, with slots as `str.format` has them."""

    def filled(self, **slots: object) -> str:
        """Return the text with its slots filled."""
        return self.value.format(**slots)


class OfResult(Remark):
    """What is said of a returned value, whichever function returned it."""

    WRONG_KIND = "it returns {kind}; it must return {what}"
    NO_NUMBERS = "{what} must be numbers; you return {kind}"
    WRONG_SHAPE = "{what} must be an array of shape {expected}; you return one of shape {shape}"
    PASSED = "{remark}; right in {others}, too"


class OfGravity(Remark):
    """What is said of `demo_gravity`."""

    PASSED = "{joint} after {seconds} s: {on:.3f}° with servos, {off:.2f}° without"
    SWAPPED = "the two lists are swapped: return (on, off)"
    PAIRS = "it returns {kind}, with a pair for each second: return two lists, (on, off)"
    ONE_NUMBER = (
        "{trace}: you return {columns} numbers for each second; one is needed, that of {joint}"
    )
    LENGTH = (
        "{trace}: you return {length} numbers; {needed} are needed, one at each of 0 … {seconds} "
        "s, where {seconds} is the argument seconds"
    )
    COMMAND = (
        "you wrote ctrl[{entry}] ({actuator}), which was {value:g} then. Nobody writes ctrl in "
        "this exercise: leave that line out, and the command stays zero"
    )
    COMMAND_BETWEEN = (
        "ctrl was written during a run, and was zero again when the function returned. Nobody "
        "writes ctrl in this exercise: leave that line out"
    )
    NO_STEP = "no step was taken with the model that you got"
    SHORT_RUNS = (
        "your runs took {steps}: {seconds} s are {needed} steps of {timestep:g} s, with the servos "
        "on and again with them off"
    )
    FIGURES = "{trace}: you return {value} at {second} s where {expected} is expected"
    MISTAKE = "{figures}: {mistake}"
    OF_TRACE = "{trace}: {mistake}"
    RADIANS = "these are radians; np.degrees(…) makes degrees of them"
    RADIANS_AGAIN = (
        "np.radians was called on what is in radians already; np.degrees(…) makes degrees of it"
    )
    DEGREES_TWICE = "np.degrees was called twice"
    OTHER_JOINT = (
        "that is qpos[{entry}], of {owner!r}; {joint} is at qpos[{place}]: "
        "model.jnt_qposadr[model.joint_id(…)]"
    )
    SPEED = "that is the speed of the joint, from qvel; its position is in qpos"
    COURSE = "that belongs to the course's own scene, not to the model that you got"
    COURSE_LOADED = (
        "that belongs to the course's own scene: your function steps a model of its own, and not "
        "the one that it got"
    )
    SERVOS_ON = (
        "the servos were still on in this run; model.replace(actuation=False) gives a Model whose "
        "servos are off"
    )
    SERVOS_OFF = "the servos were off already in this run"
    AND_RADIANS = "{servos}. These are radians, too"
    STEPS_A_SECOND = (
        "you took {steps} for a second, and at {timestep:g} ms a step a second has {needed}: "
        "round(1 / model.timestep)"
    )
    STILL = (
        "nothing moves in this run, as if there were no gravity. Leave gravity on: "
        "model.replace(actuation=False) switches the servos off"
    )
    ZEROS = (
        "the arm moves in this run, and you return zeros, or nearly. Are they its speed, qvel, or "
        "another joint? {joint} is at qpos[model.jnt_qposadr[model.joint_id(…)]]"
    )
    LAST_NUMBER = (
        "all of them are the number at the end: you kept a view of the simulator's own memory, "
        "which changes. Keep numbers, float(data.qpos[…])"
    )
    GOES_ON = (
        "this run goes on where the other one ended, at {start:.3f}°; a new Data begins at the "
        "default state"
    )
    LATE = "that is the arm {shift:g} s later (the first number is at 0 s)"
    EARLY = "that is the arm {shift:g} s earlier (the first number is at 0 s)"
    BY_THE_CLOCK = (
        "you took {steps} steps from {second} s to {next} s, where a second has {needed}. After "
        "{before} steps data.time is {time!r}, since adding up {timestep:g} rounds each time: "
        "count steps, round(1 / model.timestep), instead of comparing times"
    )
    FLAG_LEFT = (
        "the model was given back with its servos off (model.raw.opt.disableflags is {now}, it "
        "was {before}): switch the bit back, or use model.replace(actuation=False)"
    )
    MODEL_CHANGED = (
        "the model was given back with another model.raw.{name}: switch it back before you return"
    )


class OfState(Remark):
    """What is said of `demo_state`."""

    PASSED = "all {joints} joints, {free} with 7 and 6 numbers"
    SWAPPED = "the two are swapped: return (slots, time)"
    NO_DICT = "slots must be a dict {{joint: (slice of qpos, slice of qvel)}}; you return {kind}"
    LIST = (
        "slots is {kind}, and must be a dict with the names of the joints: "
        "slots[name] = (slice of qpos, slice of qvel)"
    )
    MISSING = (
        "slots: {missing} of {joints} joints are missing: {names}; the keys are model.joint_names"
    )
    OTHER_KEYS = (
        "slots: {missing} of {joints} joints are missing, and {key} is the name of no joint: the "
        "keys must be model.joint_names"
    )
    UNKNOWN = "slots: no joint is called {name!r}; the keys are model.joint_names"
    ONE_SLICE = "{joint}: you return one slice; a pair is needed, (slice of qpos, slice of qvel)"
    NO_PAIR = "{joint}: you return {kind}; a pair is needed, (slice of qpos, slice of qvel)"
    PAIR_OF_PAIRS = "{joint}: the pair holds {kinds}; write slice({start}, {stop})"
    PAIR_OF_NUMBERS = (
        "{joint}: the pair holds numbers; write slice(begin, end), with end after the last number"
    )
    PAIR_OF_ARRAYS = (
        "{joint}: the pair holds arrays, what stands in the slots; return the slices themselves"
    )
    PAIR_OF_OTHERS = "{joint}: the pair holds {kind}; write slice(begin, end)"
    STEPS = "{joint}: {slice} leaves numbers out; write slice(begin, end)"
    NOT_WHOLE = "{joint}: a slice needs two whole numbers; you return {slice}"
    PAIRS_SWAPPED = "each pair is swapped: (slice of qpos, slice of qvel) is the order"
    FIGURES = (
        "{joint}: you return {array}[{start}:{stop}] where {array}[{begin}:{end}] is expected: "
        "{why}"
    )
    OTHER_ARRAY = "that is where it begins in {array}; see {table}"
    JOINT_NUMBER = (
        "it begins at the number of the joint, {number}; a joint before it owns several numbers: "
        "see {table}"
    )
    ELSEWHERE = "it begins elsewhere: read the place in {table}, without arithmetic"
    FREE_HAS_MORE = (
        "a free joint owns more than one number, in qpos three and a quaternion, in qvel six; "
        "model.jnt_type tells which joint is free"
    )
    SIX_IN_QVEL = (
        "a quaternion has four numbers, and an angular velocity three: six in qvel, not seven"
    )
    SEVEN_IN_QPOS = "a place has three numbers, and a quaternion four: seven in qpos, not six"
    END = "the end of a slice is one after the last number"
    SIZE = "it begins at the right place and has {size}, not {needed}"
    TIME_KIND = "time must be a number of seconds; you return {kind}"
    TIME = "time after the reset to keyframe 0 should be {expected:g} s, you return {time:g}"
    TIME_WHY = "{text}: {why}"
    TIME_NEW = "that is the time of a new Data, or after a reset without keyframe=0"
    TIME_ZEROED = "data.time was set to zero; return it as the reset leaves it"
    TIME_OTHER = "that is the time of keyframe {number}"
    TIME_COURSE = "that is the time in the course's own scene; read it with the model that you got"
    TIME_STEPPED = "read it right after the reset, before any step"


class OfForward(Remark):
    """What is said of `demo_forward`."""

    PASSED = "a write changed nothing derived; forward moved the tip by {moved}"
    PASSED_WITH_COMMAND = (
        "a write changed nothing derived; forward moved the tip by {moved} (you wrote ctrl, too, "
        "which moved nothing: a command acts when step is called)"
    )
    STEPPED = (
        "{time:g} s passed: step was called. forward recomputes what is derived and takes no time"
    )
    OWN_MEMORY = (
        "all four readings are the last one, {place} m: what you read is the simulator's own "
        "memory, which changes. Keep copies: data.site_xpos[…].copy()"
    )
    ONLY_THE_LAST = (
        "all four readings are the last one, {place} m: read only at the end, or from the "
        "simulator's own memory, which changes. Keep copies: data.site_xpos[…].copy()"
    )
    MILLIMETRES = "the readings are in millimetres: positions are in metres here"
    OTHER_PLACE = "that is the place of {places}; read the site {tip!r}"
    OTHER_DATA = (
        "all four readings are at the origin: forward was called on another Data than the one that "
        "you read. Make one Data, and call sm.forward(model, data) on that one"
    )
    READ_ONCE = (
        "all four readings are at the origin, though forward was called: was the place read once, "
        "before it? Read data.site_xpos[…] anew each time"
    )
    READING = "reading {reading}: {why}"
    FEW_DIGITS = "{remark}; {dtype} keeps few digits, leave the conversion out"
    NO_NUMBER = "you return {place} m"
    COURSE = "that belongs to the course's own scene, not to the model that you got"
    ROUNDED = "it was rounded, {away}: return what you read as it is"
    NEVER_FORWARD = (
        "derived values were read before any forward, which was never called: still at the "
        "origin, {away}"
    )
    BEFORE_FORWARD = "derived values were read before any forward: still at the origin, {away}"
    SEVERAL_DATA = (
        "it is of a new Data, on which forward was not called: still at the origin, {away}. You "
        "made {count} Data; make one, and read it four times"
    )
    OTHER_PLACE_AWAY = "that is the place of {places}, {away}; read the site {tip!r}"
    FIGURES = "you return {value} m where {expected} m is expected, {away}"
    WRITTEN_EARLY = "qpos was written before the first forward: that is the new pose, {away}"
    FORWARD_EARLY = "forward was called before it was read: that is the new pose already, {away}"
    NOT_FRESH = (
        "forward was called before this reading: in a new Data nothing is derived yet, and every "
        "site is at the origin, {away}"
    )
    OTHER_ANGLE = "that is the arm at {angle}, {away}: qpos is in radians, write {expected} into it"
    OTHER_ENTRY = (
        "you wrote qpos[{entry}], which is {owner!r}; {joint} is at qpos[{place}]: "
        "model.jnt_qposadr[model.joint_id(…)]; the fingertip is {away}"
    )
    ONE_MORE_ENTRY = (
        "you also wrote qpos[{entry}], which is {owner!r}; leave that out: the fingertip is {away}"
    )
    SECOND_FORWARD_LATE = "it was read before the second forward: that is the old pose, {away}"
    NO_SECOND_FORWARD = "derived values were read before forward: that is the old pose, {away}"
    NOTHING_WRITTEN = (
        "nothing was written into qpos of a Data, or not before this forward: that is the old "
        "pose, {away}. data.qpos[…] = {angle} writes; a copy, or a reset after it, does not"
    )
    WROTE_QPOS = (
        "you wrote qpos[{entry}], which is {owner!r}: that is the old pose, {away}; {joint} is at "
        "qpos[{place}]"
    )
    WROTE_CTRL = (
        "you wrote ctrl[{entry}], a command, on which the arm would act with time: that is the "
        "old pose, {away}; {joint} is at qpos[{place}]"
    )
    WROTE_QVEL = (
        "you wrote qvel[{entry}], a speed: that is the old pose, {away}; {joint} is at "
        "qpos[{place}]"
    )


class OfReplay(Remark):
    """What is said of `demo_replay`."""

    PASSED = "two runs of {nstep} steps end in the same bits"
    RUN = "{which} run: {fault}"
    SAME_KIND = "same must be True or False; you return {kind}"
    SAME_ELEMENTS = (
        "same must be True or False; you return {kind}, one answer for each number. "
        "np.array_equal(first, second) gives one for all"
    )
    ORDER = "the order is (same, first, second); you return same as number {place}"
    WHOLE_DATA = "{which} must be a copy of qpos; you return {kind}: return data.qpos.copy()"
    QVEL = (
        "{which} has {nv} numbers, as qvel has; return a copy of qpos, which has {nq}: "
        "data.qpos.copy()"
    )
    LEFT_OVER = (
        "the two runs ended {apart:.1e} apart though both began at keyframe 0: something of the "
        "first run was left over. sm.reset clears everything, or use a new Data"
    )
    ALWAYS_TRUE = (
        "the two runs ended {apart:.1g} apart, and same is True: is True typed in, or a run "
        "compared with itself? Return what np.array_equal(first, second) says"
    )
    NEARLY = (
        "the two runs ended {apart:.1e} apart and you call them equal: nearly equal is not equal. "
        "np.array_equal compares every bit; np.allclose, rounding and sums do not"
    )
    DIFFERENT = (
        "both runs ended in the same bits and you call them different: "
        "np.array_equal(first, second) compares them"
    )
    OTHER_END = (
        "it did not end where {steps} under this command take this arm: nothing but ctrl may act "
        "on it"
    )
    ONE_ARRAY_LIVE = (
        "first and second are one array: both show the last run. Keep a copy of each, "
        "data.qpos.copy()"
    )
    ONE_ARRAY = "first and second are one array: return the end of each run"
    LIVE = (
        "{which} is data.{live} itself, which changes with the next step or reset: return a copy, "
        "data.{live}.copy()"
    )
    FEW_DIGITS = (
        "{which} is {dtype}, which has fewer digits: qpos is float64, and every bit counts here. "
        "Leave the conversion out"
    )
    NO_STEP = "no step was taken: two runs of {nstep} steps are needed"
    FORWARD_FOR_STEP = (
        "no step was taken: forward takes no time. Two runs of {nstep} steps are needed, "
        "sm.step(model, data, nstep)"
    )
    OTHER_MODEL = "no step was taken with the model that you got, but with another"
    NO_RESET_BETWEEN = (
        "there was one run of {steps} steps: the second did not begin at keyframe 0 but went on "
        "where the first had ended. Reset before each"
    )
    ONE_RUN = "there was only one run: one run compared with itself is always equal. Run twice"
    MANY_RUNS = (
        "there were {runs} runs, of {steps} steps: two are needed, and nothing may be written into "
        "qpos, qvel or time between their steps"
    )
    COMMAND_IN_QPOS = (
        "the command was written into qpos, and the arm was there at once: write it into ctrl, "
        "and the servos take it there"
    )
    ELSEWHERE = (
        "it did not begin at keyframe 0: {array} was up to {gap:.2g} away. "
        "sm.reset(model, data, keyframe=0) goes there"
    )
    KEYFRAMES_TIME = (
        "it began at {time:g} s, the keyframe's time: write data.time = 0.0 after the reset"
    )
    TIME = "it began at {time:g} s: write data.time = 0.0 before the first step"
    CTRL_CHANGED = "ctrl was changed after step {step}: it must stay the same"
    STEPS = "it took {steps} where {nstep} are needed, the argument nstep"
    CTRL_LATE = (
        "at its first step ctrl was {ctrl}, and it was written only after {steps}: write ctrl "
        "before the first step"
    )
    CTRL_LATE_KEYFRAMES = (
        "at its first step ctrl was the keyframe's own, and it was written only after {steps}: "
        "write ctrl before the first step"
    )
    CTRL_NOT_WRITTEN = (
        "at its first step ctrl was the keyframe's own: a reset overwrites ctrl, and a copy of "
        "ctrl is no command. Write data.ctrl[:] = ctrl after the reset"
    )
    CTRL_ADDED = (
        "at its first step ctrl was the keyframe's own and the command together: += adds to it; "
        "data.ctrl[:] = ctrl sets it"
    )
    CTRL_DEGREES = (
        "at its first step ctrl was {ctrl}: degrees were made of it, and the command is in radians "
        "as it is"
    )
    CTRL_RADIANS = (
        "at its first step ctrl was {ctrl}: radians were made of it, and the command is in radians "
        "as it is"
    )
    CTRL_ENTRY = (
        "at its first step ctrl[{entry}] ({actuator}) was {value:g}; the command there is "
        "{expected:g}"
    )
    CTRL_OTHER = "at its first step ctrl was {ctrl}; the command is {expected}, the argument ctrl"
    END = "{which} is up to {away:.1e} away from qpos at the end of its run: {why}"
    AT_START = "that is qpos at the start"
    FIRST_TWICE = "the first run was returned twice"
    SECOND_END = "that is the end of the second run"
    ROUNDED = "was it rounded? Every bit counts here"
    ROUNDED_OR_EARLY = "was it rounded, or read before the last step?"
    READ_AT_END = "return data.qpos.copy() after the last step"
