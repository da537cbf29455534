// Runs the script that starts a fire, called Player here, outside of Unity: prints where each of twelve
// begins, of a loop and then of what plays once, and how fast its Animator plays; and the same when it
// begins again.
//
// [RANDOM SPREAD]                its properties
// RANDOM SPREAD NUMBER STATE...  of twelve of that variant, or of any (-1), instead: the state in which each
//                                begins, and begins again, and whether it is mirrored then

using System;
using System.Globalization;
using System.Linq;
using System.Threading;
using UnityEngine;

static class Harness
{
    static readonly CultureInfo Plain = CultureInfo.InvariantCulture;

    static void Main(string[] args)
    {
        Thread.CurrentThread.CurrentCulture = new CultureInfo("de-DE");
        if (args.Length > 2) for (int i = 0; i < 12; i++) Vary(int.Parse(args[2]), args.Skip(3).ToArray());
        else foreach (bool loop in new[] { true, false })
        {
            for (int i = 0; i < 12; i++) Begin(loop, args);
        }
    }

    static void Begin(bool loop, string[] args)
    {
        var animator = new Animator { enabled = true, speed = 2 };
        animator.Current = new AnimatorStateInfo { shortNameHash = 7, loop = loop };
        var player = new Player { enabled = true };
        Private.Set(player, "animator", animator);
        if (args.Length > 0) Private.Set(player, "randomStart", bool.Parse(args[0]));
        if (args.Length > 0) Private.Set(player, "speedSpread", float.Parse(args[1], Plain));
        Action enable = Private.Call(player, "OnEnable"), update = Private.Call(player, "Update");
        for (int times = 0; times < 2; times++)
        {
            enable();
            update();
            float begun = animator.Current.normalizedTime;
            update();
            Console.Write("{0} {1} {2} {3} ", Text(begun), Text(animator.Current.normalizedTime), animator.Current.shortNameHash, Text(animator.speed));
            animator.Current.normalizedTime = 0;
        }
        Console.WriteLine();
    }

    static void Vary(int variant, string[] variants)
    {
        var animator = new Animator { enabled = true };
        var sprite = new SpriteRenderer();
        var player = new Player { enabled = true };
        Private.Set(player, "animator", animator);
        Private.Set(player, "sprite", sprite);
        Private.Set(player, "randomMirror", true);
        Private.Set(player, "variant", variant);
        Private.Set(player, "variants", variants);
        Action enable = Private.Call(player, "OnEnable"), update = Private.Call(player, "Update");
        for (int times = 0; times < 2; times++)
        {
            enable();
            update();
            string state = variants.First(name => Animator.StringToHash(name) == animator.Current.shortNameHash);
            Console.Write("{0} {1} ", state, sprite.flipX);
            animator.Current.shortNameHash = 0;
        }
        Console.WriteLine();
    }

    static string Text(float number)
    {
        return number.ToString("R", Plain);
    }
}
