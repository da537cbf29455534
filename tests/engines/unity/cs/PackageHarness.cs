// Runs the package outside of Unity and prints what it does.
//
// light FILE TIME,...             intensity, colour and place of the light at each time
// play FILE                       what a player sets and announces over two rounds; its allocations
// phases FILE                     the same of a player that puts out a fire and lights it: Burning as its
//                                 Animator knows it, light, and how often it announced Lit and WentOut
// apart [RANDOM SPREAD]           of twelve players of a loop, then of what plays once: where they begin, where
//                                 they are an update later, the state, and the Animator's speed at speed 2
// vary NUMBER STATE...            of twelve players of that variant, or of any (-1): the state in which each begins,
//                                 whether it is mirrored, and how often it announced WentOut in that variant's "out"
// arguments NAME...               the command line for recipes, then whether each name is a recipe
// build COMMAND PROJECT NAME...   selects assets and builds them; "" selects none and builds all
// stop COMMAND PROJECT NAME...    the same, cancelled at once
// import COMMAND PROJECT NAME...  imports assets: with the preference off, on, and on while that build runs

using System;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Reflection;
using System.Threading;
using FireAtlas;
using FireAtlas.Editor;
using UnityEditor;
using UnityEngine;
using UnityEngine.Rendering;

static class PackageHarness
{
    static readonly CultureInfo Plain = CultureInfo.InvariantCulture;

    static void Main(string[] args)
    {
        Thread.CurrentThread.CurrentCulture = new CultureInfo("de-DE");
        string[] rest = args.Skip(1).ToArray();
        switch (args[0])
        {
            case "light": Light(rest[0], rest[1].Split(',')); break;
            case "play": Play(rest[0]); break;
            case "phases": Phases(rest[0]); break;
            case "apart": foreach (bool loop in new[] { true, false }) Apart(loop, rest); break;
            case "vary": Vary(rest[0], rest.Skip(1).ToArray()); break;
            case "arguments": Arguments(rest); break;
            default: Build(args[0], rest); break;
        }
    }

    static TextAsset Asset(string path)
    {
        return new TextAsset { Content = File.ReadAllBytes(path) };
    }

    static void Print(params float[] numbers)
    {
        Console.WriteLine(string.Join(" ", numbers.Select(number => number.ToString("R", Plain))));
    }

    static void Light(string path, string[] times)
    {
        LightTrack track = LightTrack.Of(Asset(path));
        if (track == null) return;
        foreach (string time in times)
        {
            LightTrack.Moment now = track.At(float.Parse(time, Plain));
            Print(now.intensity, now.colour.r, now.colour.g, now.colour.b, now.x, now.y);
        }
    }

    static void Play(string path)
    {
        var animator = new Animator { enabled = true };
        animator.Current.loop = true;
        var sprite = new SpriteRenderer { color = new Color(0.5f, 0.5f, 0.5f, 1) };
        var lamp = new Light();
        var flakes = new FireAtlasFlakes();
        Component.Siblings = type => type == typeof(Animator) ? animator : type == typeof(SpriteRenderer) ? sprite
            : type == typeof(Light) ? (object)lamp : flakes;
        var player = new FireAtlasPlayer { enabled = true };
        player.transform.Children = new[] { "Heat", "Flakes" };
        Private.Call(player, "Reset")();
        Console.WriteLine("flakes after Reset {0}, tint {1}", player.ShowFlakes, player.Tint.r.ToString(Plain));
        Private.Set(player, "lights", new[] { new FireAtlasPlayer.StateLight { state = "fire", track = Asset(path), pivot = new Vector2(30, 54) } });
        Private.Set(player, "pixelsPerUnit", 50f);
        Private.Set(player, "state", "fire");
        Private.Set(player, "randomStart", false);
        Private.Set(player, "speedSpread", 0f);
        Private.Call(player, "OnEnable")();
        Action update = Private.Call(player, "Update"), late = Private.Call(player, "LateUpdate");
        player.Speed = 2;
        player.LampIntensity = 3;
        player.Tint = new Color(1, 0.5f, 0.25f, 0.5f);
        player.ShowFlakes = true;
        GraphicsSettings.lightsUseLinearIntensity = true;
        foreach (float time in new[] { 0, 0.4f, 1.1f, 1.9f, 2 })
        {
            animator.Current.normalizedTime = time;
            update();
            late();
            Vector3 place = lamp.transform.localPosition;
            Print(lamp.intensity, lamp.color.r, lamp.color.g, lamp.color.b, place.x, place.y, player.Looped.Times, player.Finished.Times);
        }
        flakes.enabled = false;
        update();
        Console.WriteLine("flakes that turned themselves off " + flakes.enabled);
        player.ShowFlakes = false;
        update();
        player.ShowFlakes = true;
        update();
        Print(animator.speed, sprite.color.r, sprite.color.g, sprite.color.b, sprite.color.a, flakes.enabled ? 1 : 0);
        player.Playing = false;
        sprite.flipX = true;
        update();
        late();
        Print(animator.speed, lamp.transform.localPosition.x);
        animator.Current.loop = false;
        player.Play("fire", 0.5f);
        foreach (float time in new[] { 0.5f, 0.9f, 1, 1.2f })
        {
            animator.Current.normalizedTime = time;
            late();
        }
        Print(player.Looped.Times, player.Finished.Times, player.Playing ? 1 : 0);
        GC.Collect();
        int collections = GC.CollectionCount(0);
        animator.Current.loop = true;
        for (int i = 0; i < 20000; i++)
        {
            animator.Current.normalizedTime = i * 0.013f;
            update();
            late();
        }
        Print(GC.CollectionCount(0) - collections);
    }

    static void Apart(bool loop, string[] stated)
    {
        for (int i = 0; i < 12; i++)
        {
            var animator = new Animator { enabled = true };
            animator.Current = new AnimatorStateInfo { shortNameHash = 7, loop = loop };
            var player = new FireAtlasPlayer { enabled = true };
            Private.Set(player, "animator", animator);
            if (stated.Length > 0) Private.Set(player, "randomStart", bool.Parse(stated[0]));
            if (stated.Length > 0) Private.Set(player, "speedSpread", float.Parse(stated[1], Plain));
            Private.Call(player, "OnEnable")();
            Action update = Private.Call(player, "Update"), late = Private.Call(player, "LateUpdate");
            update();
            float begun = animator.Current.normalizedTime;
            player.Speed = 2;
            update();
            late();
            Print(begun, animator.Current.normalizedTime, animator.Current.shortNameHash, animator.speed);
        }
    }

    static void Vary(string variant, string[] variants)
    {
        for (int i = 0; i < 12; i++)
        {
            var animator = new Animator { enabled = true, Parameters = new[] { "Burning" } };
            animator.Current = new AnimatorStateInfo { loop = true };
            var sprite = new SpriteRenderer();
            var player = new FireAtlasPlayer { enabled = true };
            Private.Set(player, "animator", animator);
            Private.Set(player, "sprite", sprite);
            Private.Set(player, "randomMirror", true);
            Private.Set(player, "variant", int.Parse(variant));
            Private.Set(player, "variants", variants);
            Private.Call(player, "OnEnable")();
            Action update = Private.Call(player, "Update"), late = Private.Call(player, "LateUpdate");
            update();
            late();
            string begun = Name(animator, variants);
            int went = 0;
            player.WentOut.AddListener(() => went++);
            player.Extinguish();
            update();
            animator.Play(begun.Replace("burn", "out"));
            late();
            Console.WriteLine("{0} {1} {2}", begun, sprite.flipX, went);
        }
    }

    static string Name(Animator animator, string[] names)
    {
        return names.First(name => Animator.StringToHash(name) == animator.Current.shortNameHash);
    }

    static void Phases(string path)
    {
        int parameter = Animator.StringToHash("Burning");
        var animator = new Animator { enabled = true, Parameters = new[] { "Size", "Burning" } };
        var lamp = new Light();
        var player = new FireAtlasPlayer { enabled = true };
        Private.Set(player, "animator", animator);
        Private.Set(player, "lamp", lamp);
        Private.Set(player, "lights", new[] { new FireAtlasPlayer.StateLight { state = "burn", track = Asset(path) } });
        Private.Set(player, "randomStart", false);
        Private.Set(player, "speedSpread", 0f);
        Private.Call(player, "OnEnable")();
        Action update = Private.Call(player, "Update"), late = Private.Call(player, "LateUpdate");
        int lit = 0, out_ = 0;
        player.Lit.AddListener(() => lit++);
        player.WentOut.AddListener(() => out_++);

        Action<string> show = state =>
        {
            animator.Bools.Clear();
            update();
            if (state != null) animator.Current = new AnimatorStateInfo { shortNameHash = Animator.StringToHash(state), loop = state == "burn" };
            late();
            bool told, known = animator.Bools.TryGetValue(parameter, out told);
            bool isOut = animator.Current.shortNameHash == Animator.StringToHash("out");
            Console.WriteLine("{0} {1} {2} {3} {4}", known ? told.ToString() : "untold", isOut ? "out" : "shown", lamp.intensity > 0 ? "bright" : "dark", lit, out_);
        };

        show("burn");
        player.Extinguish();
        foreach (string state in new[] { "burn", "extinguish_1", "extinguish", "out", "out" }) show(state);
        player.Ignite();
        foreach (string state in new[] { "out", "ignite", "burn", "burn" }) show(state);
        player.Burning = false;
        show("burn");
        Console.WriteLine("an Animator that begins again");
        animator.enabled = false;
        update();
        animator.enabled = true;
        animator.Current.shortNameHash = Animator.StringToHash("burn");
        show(null);
        Console.WriteLine("a fire that does not burn as it begins, and one that begins elsewhere");
        foreach (string begin in new[] { "", "burn" })
        {
            Private.Set(player, "state", begin);
            animator.Current.shortNameHash = Animator.StringToHash("burn");
            Private.Call(player, "OnEnable")();
            show(null);
        }
        GC.Collect();
        int collections = GC.CollectionCount(0);
        for (int i = 0; i < 20000; i++)
        {
            player.Burning = i % 2 == 0;
            animator.Current.normalizedTime = i * 0.013f;
            update();
            late();
        }
        Console.WriteLine("collections " + (GC.CollectionCount(0) - collections));
        animator.Parameters = new[] { "Size" };
        Private.Call(player, "OnEnable")();
        foreach (string state in new[] { "out", "burn" }) show(state);
    }

    static void Arguments(string[] names)
    {
        Console.WriteLine(RecipeBuild.Arguments(names));
        foreach (string name in names) Console.WriteLine(RecipeBuild.IsRecipe(name));
    }

    static void Build(string how, string[] args)
    {
        RecipePreferences.Command = args[0];
        Application.dataPath = args[1] + "/Assets";
        Selection.assetGUIDs = args.Skip(2).ToArray();
        if (how == "import") Import(Selection.assetGUIDs);
        else if (args[2] == "") RecipeMenu.StartAll();
        else RecipeMenu.StartSelected();
        if (how == "stop") Progress.Cancel(1);
        while (RecipeMenu.Running)
        {
            EditorApplication.update();
            Thread.Sleep(20);
        }
        Console.WriteLine("locks " + EditorApplication.Locks + (EditorApplication.update == null ? "" : " still watching"));
    }

    static void Import(string[] assets)
    {
        MethodInfo found = typeof(RecipeImport).GetMethod("OnPostprocessAllAssets", BindingFlags.Static | BindingFlags.NonPublic);
        var none = new string[0];
        found.Invoke(null, new object[] { assets, none, none, none });
        Console.WriteLine("off: running " + RecipeMenu.Running);
        RecipePreferences.BuildOnImport = true;
        for (int i = 0; i < 2; i++) found.Invoke(null, new object[] { assets, none, none, none });
        Console.WriteLine("on: running " + RecipeMenu.Running);
    }
}
