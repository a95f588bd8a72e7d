"""Questions about two sides, one in each file: a frozen Request, and `answer(request, reporter)`.

    from statemachine.lab.compare import Request
    from statemachine.lab.questions.requests.gap import CompareRequest, answer

    result = answer(CompareRequest(Request(("hold",))))
    result.comparison.agrees

`gap` is how far apart two runs are, `causes` which difference explains how much of that,
`one_step` which stage of a step differs first, `converge` what vanishes with the timestep,
`versions` between which releases it changes, and `models` what two files differ in before
anything moves.
"""
